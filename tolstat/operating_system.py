"""What operating systems do differently.

No other file imports a module or calls a function that one of them lacks, Windows
among them. Each function here says what happens without it.
"""

import errno
import math
import os
import shutil
import signal
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, BinaryIO

# a command that gets one of these stops; not every system has the last two
STOP_SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)
)
# most memory of a container, bytes: control groups of version 2 and 1
CONTAINER_LIMITS = (
    "/sys/fs/cgroup/memory.max",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes",
)

BLAS_THREADS = "OPENBLAS_NUM_THREADS"
ONE_THREAD = "01"  # of BLAS, unlike what a user types

PR_SET_PDEATHSIG = 1  # of prctl
LINES = 1  # of setvbuf: _IOLBF


def processors() -> int:
    """Return the number of processors that this process may use, or of all."""
    with suppress(AttributeError):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def limit_blas() -> None:
    """Leave BLAS one thread once it is loaded, unless the user sets their number."""
    os.environ.setdefault(BLAS_THREADS, ONE_THREAD)


def restore_environment() -> None:
    """Undo `limit_blas` for programs that this process starts; BLAS is loaded."""
    if os.environ.get(BLAS_THREADS) == ONE_THREAD:
        del os.environ[BLAS_THREADS]


def make_private(folder: Path) -> None:
    """Create a folder whose content other users than root cannot have written.

    It is removed first if they could. A PermissionError names a folder that belongs to
    another user, or one above that others can write; a sticky one, such as /tmp, is
    no danger. Where systems know no users, the folder is only created.
    """
    for path in (*reversed(folder.parents), folder):
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.stat()
        if not hasattr(os, "getuid"):
            continue
        if status.st_uid not in (0, os.getuid()):
            raise PermissionError(0, f"{path} belongs to another user")
        if path == folder and status.st_mode & 0o077:
            shutil.rmtree(path)
            path.mkdir(mode=0o700)
        elif status.st_mode & 0o022 and not status.st_mode & stat.S_ISVTX:
            raise PermissionError(0, f"other users can write to {path}")


def local_time(seconds: float) -> str:
    """Return a time since 1970, to the millisecond and with its zone.

    Runs in a row are ordered by it. UTC where TZ is none.
    """
    try:
        time = datetime.fromtimestamp(seconds).astimezone()
    except ValueError:  # a zone of a day or more, such as TZ=UTC+24
        time = datetime.fromtimestamp(seconds, UTC)
    return time.isoformat(timespec="milliseconds")


def process_exists(number: int) -> bool:
    """Return whether a process with this number runs on this computer."""
    import psutil

    with suppress(OverflowError):  # larger than any
        found: bool = psutil.pid_exists(number)
        return found
    return False


def memory() -> float:
    """Return how much memory this process may have, bytes; without limits, all."""
    import psutil

    limits = [float(psutil.virtual_memory().total), address_space()]
    for path in CONTAINER_LIMITS:
        with suppress(OSError, ValueError):  # ValueError: "max"
            limits.append(float(int(Path(path).read_text())))
    return min(limits)


def address_space() -> float:
    """Return how much this process may map, bytes; infinite without limit."""
    return min(_resource_limit("RLIMIT_AS"), _resource_limit("RLIMIT_DATA"))


def largest_file() -> float:
    """Return how large a file of this process may be, bytes; infinite without limit."""
    return _resource_limit("RLIMIT_FSIZE")


def _resource_limit(name: str) -> float:
    try:
        import resource
    except ImportError:
        return math.inf
    limit, _ = resource.getrlimit(getattr(resource, name))
    return math.inf if limit == resource.RLIM_INFINITY else float(limit)


def lock(file: IO[Any], *, wait: bool = False) -> bool:
    """Lock an open file until it is closed or the process ends.

    False if another process has locked it, unless that is waited for. A file system
    without locks counts as locked.
    """
    import portalocker

    now = portalocker.LockFlags(0) if wait else portalocker.LOCK_NB
    try:
        portalocker.lock(file, portalocker.LOCK_EX | now)
    except portalocker.AlreadyLocked:
        return False
    except (portalocker.LockException, OSError):
        return True
    return True


def open_regular(path: Path, flags: int, mode: int = 0o666) -> BinaryIO:
    """Open a file, unbuffered; links are not followed where it is written.

    A folder, a pipe or another device is an OSError, and never waited for.
    """
    writing = flags & os.O_RDWR
    flags |= getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    flags |= getattr(os, "O_NOFOLLOW", 0) if writing else 0
    descriptor = os.open(path, flags, mode)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "a folder or a device; a file is expected")
    return os.fdopen(descriptor, "r+b" if writing else "rb", buffering=0)


@contextmanager
def held_open(path: Path) -> Iterator[None]:
    """Keep a pipe or terminal open for writing; OSError for a pipe without a reader."""
    try:
        descriptor = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
    except OSError as error:
        if error.errno != errno.ENXIO:
            raise
        raise OSError(errno.ENXIO, "a pipe that no program reads") from error
    try:
        yield
    finally:
        os.close(descriptor)


def is_mine(file: os.stat_result) -> bool:
    """Return whether a file belongs to this user; true where systems know no users."""
    return not hasattr(os, "getuid") or file.st_uid == os.getuid()


def give_owner(path: Path, like: os.stat_result) -> None:
    """Give a file the owner of another, as root may; where systems know users."""
    with suppress(AttributeError, OSError):
        os.chown(path, like.st_uid, like.st_gid)


def give_second_name(path: Path, other: Path) -> None:
    """Give a file a second name; on a file system without links a copy gets it."""
    try:
        os.link(path, other)
    except (AttributeError, OSError):
        shutil.copy2(path, other)


def cannot_isolate() -> str:
    """Return why this system has no processes that end with their parent, or ""."""
    if sys.platform == "linux":
        return ""
    return f"processes that may crash need Linux; this system is {sys.platform}"


def prepare_forks() -> None:
    """Import what `limit_data` and others need, so that no new process has to."""
    import resource  # noqa: F401

    _c_library()


def fork() -> int:
    """Return the number of a new process, and 0 in it; on Linux alone."""
    return os.fork()


def end_with_parent(parent: int) -> None:
    """Let the kernel end this process when its parent ends; on Linux alone."""
    _c_library().prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it has ended already
        os._exit(0)


def lead_group() -> None:
    """Give this process a group of its own, for itself and what it starts."""
    os.setpgid(0, 0)


def kill_group(number: int) -> None:
    """End a process that is not waited for yet, and those of its group."""
    for kill in (os.killpg, os.kill):
        with suppress(ProcessLookupError):
            kill(number, signal.SIGKILL)


def exit_status(number: int) -> int:
    """Wait for a child; return its exit code, or minus the signal that ended it."""
    try:
        return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])
    except ChildProcessError:
        return 0


def memory_file() -> BinaryIO:
    """Return a file without a name, in memory; on Linux alone."""
    return os.fdopen(os.memfd_create("tolstat"), "r+b", buffering=0)


def signal_name(number: int) -> str:
    """Return the name of a signal, such as SIGSEGV."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def private_data() -> int:
    """Return how many bytes of private memory this process has; on Linux alone."""
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    return pages * os.sysconf("SC_PAGE_SIZE")


def limit_data(most: int) -> None:
    """Let this process have so many bytes of private memory at most."""
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def wait_for_readers() -> None:
    """Let output wait for its reader, whatever another program set: else it is cut."""
    for stream in (1, 2):
        with suppress(AttributeError, OSError):
            os.set_blocking(stream, True)


def buffer_lines() -> None:
    """Let C write lines of its standard output at once: a crash loses what waits."""
    from ctypes import c_void_p

    library = _c_library()
    library.setvbuf(c_void_p.in_dll(library, "stdout"), None, LINES, 0)


def send_descriptors(channel: Any, data: bytes, numbers: list[int]) -> None:
    """Send bytes with descriptors of open files to another process."""
    from socket import send_fds

    send_fds(channel, [data], numbers)


def receive_descriptors(channel: Any, size: int, most: int) -> tuple[bytes, list[int]]:
    """Return bytes with descriptors of another process; none if it has ended."""
    from socket import recv_fds

    try:
        data, numbers, _, _ = recv_fds(channel, size, most)
    except ConnectionError:
        return b"", []
    return data, numbers


def _c_library() -> Any:
    import ctypes

    return ctypes.CDLL(None, use_errno=True)
