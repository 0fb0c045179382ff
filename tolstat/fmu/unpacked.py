"""The folder where the library of an FMU is unpacked: once, for all processes."""

import os
import platform
import shutil
import sys
import tempfile
import zipfile
from contextlib import suppress
from pathlib import Path, PurePosixPath

import platformdirs

from tolstat.errors import ModelError
from tolstat.fmu.model_xml import FmuFile
from tolstat.operating_system import make_private
from tolstat.regular_files import UNREADABLE_ARCHIVE

MOST_GIGABYTES = 8  # unpacked


def unpacked(file: FmuFile) -> Path:
    """Return the folder of an FMU, with binaries and resources.

    It is named by the digest of the file, in the user's cache.

    Raises
    ------
    ModelError
        If nothing can be written there, or the archive leads out of its folder.
    """
    home = _home()
    folder = home / file.sha256
    try:
        make_private(home)  # before anything in it is trusted: libraries are executed
        if (folder / "binaries").is_dir():
            return folder
        temporary = Path(tempfile.mkdtemp(prefix="unpacking-", dir=home))
        try:
            _unpack(file.path, temporary)
            (temporary / "resources").mkdir(exist_ok=True)
            os.replace(temporary, folder)
        except OSError:
            if not (folder / "binaries").is_dir():  # else another process was faster
                raise
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except UNREADABLE_ARCHIVE as error:
        raise ModelError(f"{file.path} is damaged: {error}; export it again") from None
    except OSError as error:
        reason = error.strerror or error
        raise ModelError(
            f"{file.path} cannot be unpacked in {home}: {reason}"
        ) from None
    return folder


def _home() -> Path:
    return platformdirs.user_cache_path("tolstat") / "fmu"


def _unpack(path: Path, folder: Path) -> None:
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}[sys.platform]
    short = {"linux": "linux", "darwin": "darwin", "win32": "win"}[sys.platform]
    processor = platform.machine().lower().replace("amd64", "x86_64")
    bits = "64" if sys.maxsize > 2**32 else "32"
    names = {f"{short}{bits}", f"{processor}-{system}", f"aarch64-{system}"}
    with zipfile.ZipFile(path) as archive:
        entries = [
            entry
            for entry in archive.infolist()
            if (parts := PurePosixPath(entry.filename).parts)
            and (
                parts[0] == "resources" or (parts[0] == "binaries" and {*parts} & names)
            )
        ]
        for entry in entries:
            parts = PurePosixPath(entry.filename).parts
            if ".." in parts or entry.filename.startswith("/"):
                raise ModelError(f"{path}: '{entry.filename}' leads out of the archive")
        if sum(entry.file_size for entry in entries) > MOST_GIGABYTES * 1e9:
            raise ModelError(
                f"{path}: more than {MOST_GIGABYTES} GB unpacked, the most allowed"
            )
        if not any(entry.filename.startswith("binaries/") for entry in entries):
            with_binaries = sorted(
                {
                    PurePosixPath(name).parts[1]
                    for name in archive.namelist()
                    if name.startswith("binaries/") and name.count("/") > 1
                }
            )
            raise ModelError(
                f"{path} has no library for {processor}-{system}; it has "
                f"{', '.join(with_binaries) or 'none'}"
            )
        archive.extractall(folder, entries)


def forgets(file: FmuFile) -> bool:
    """Return whether a trial has shown that an FMU forgets to reset what it remembers.

    All processes of this computer know it.
    """
    return (_home() / f"{file.sha256}.forgets").exists()


def note_forgetting(file: FmuFile) -> None:
    """Note that an FMU forgets to reset what it remembers."""
    with suppress(OSError):
        (_home() / f"{file.sha256}.forgets").touch()
