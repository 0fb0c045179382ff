"""Programs that know nothing of tolstat read its runs, also while it reads them."""

import shutil
import subprocess
import warnings

import h5py
import numpy as np
import pytest
import xarray

import tolstat

STUDY = {
    "model": "stand",
    "trials": 250,
    "seed": 3,
    "deviations": {"rod_length": "+-1.2 mm", "friction": "-20..+40 %"},
    "limits": {"extra_loss": "<= 3 %"},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with an audit, and trials audited again."""
    run = tolstat.run(STUDY, output=tmp_path_factory.mktemp("readers") / "run.h5")
    assert run.audited and run.audited.third
    return run


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_opens_all_groups(run, engine):
    with xarray.open_datatree(run.path, engine=engine) as tree:
        assert tree["rod_force_1"].dims == ("trial",)
        audit = tree["audit"]
        again = audit["responses/rod_force_1"]
        assert again.dims == audit["trials"].dims != ("trial",)
        np.testing.assert_array_equal(audit["trials"].values, run.audited.trials)
        third = tree["audit/third/trials"]
        np.testing.assert_array_equal(third.values, run.audited.third.trials)
        assert tree["checks/checksum"].dims == ("trial",)
        slopes = tree["diagnostics/slopes/value"]
        assert slopes.dims == ("response", "contributor")


def test_every_list_has_a_dimension(run):
    def check(name, item):
        if isinstance(item, h5py.Dataset) and not item.is_scale:
            assert all(len(dimension) == 1 for dimension in item.dims), name

    with h5py.File(run.path) as file:
        file.visititems(check)


@pytest.mark.parametrize("locking", [None, True, False, "best-effort"])
def test_a_run_that_h5py_holds_open_is_opened(run, locking):
    with h5py.File(run.path, "r", locking=locking) as file:
        assert tolstat.open(run.path).trials == len(file["trial"])


def test_a_run_that_xarray_holds_open_is_opened(run):
    """In the order of the page on exports."""
    with xarray.open_dataset(run.path, engine="h5netcdf") as trials:
        opened = tolstat.open(run.path)
        force = trials["rod_force_1"].values
    np.testing.assert_array_equal(opened.column("rod_force_1"), force)


def test_netcdf4_reads_units_and_values(run):
    import netCDF4

    with netCDF4.Dataset(run.path) as file:
        force = file["rod_force_1"]
        assert (force.dimensions, force.units) == (("trial",), "N")
        np.testing.assert_array_equal(force[:], run.column("rod_force_1"))


@pytest.mark.parametrize("program", [("ncdump", "-h"), ("h5dump", "-H")])
def test_command_line_programs(run, program):
    if not shutil.which(program[0]):
        pytest.skip(f"{program[0]} is not installed")
    done = subprocess.run(
        [*program, run.path], capture_output=True, text=True, check=True
    )
    assert "rod_force_1" in done.stdout


@pytest.mark.parametrize("reader", ["pandas", "polars", "duckdb"])
def test_tables_by_parquet(run, tmp_path, reader):
    path = tmp_path / "run.parquet"
    from tolstat.answers.export.trials_table import export

    export(run, path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of these programs
        if reader == "duckdb":
            import duckdb

            query = f"select \"rod_force_1 [N]\" from '{path}' order by trial"
            force = duckdb.sql(query).fetchnumpy()["rod_force_1 [N]"]
        elif reader == "polars":
            import polars

            force = polars.read_parquet(path)["rod_force_1 [N]"].to_numpy()
        else:
            import pandas

            force = pandas.read_parquet(path)["rod_force_1 [N]"].to_numpy()
    np.testing.assert_array_equal(force, run.column("rod_force_1"))
