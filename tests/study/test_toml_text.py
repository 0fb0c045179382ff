"""TOML is written in the order of the entries: columns of a chain follow its links."""

import tomllib

import pytest

import tolstat
from tolstat.toml import toml_text

STUDY = """
model = "dimension_chain"
trials = 200
seed = 1
settings.gap = "housing - bearing_1 - bearing_2"
links.housing = { nominal = "40.2 mm", tolerance = "+-0.05 mm" }
links.bearing_1 = "20 mm"
links.bearing_2 = "20 mm"
deviations.bearing = { tolerance = "-0.12..0 mm", common = true }
limits.gap = "0.15..0.45 mm"
"""


def order(table):
    """Return all keys, tables inside each other."""
    if not isinstance(table, dict):
        return table
    return [(key, order(value)) for key, value in table.items()]


@pytest.mark.parametrize(
    "section",
    [
        {"a": {"x": 1}, "b": "1 mm", "c": {"y": [1, {"z": 2.5}], "e": {}}},
        {"a": "1 mm", "b": {"x": 'say "1"'}, "c.d": {"y": True}, "": "2"},
        {"gap": "a", "links": {"a": {"x": "1"}, "b": "1"}, "on": "line\nline"},
        {"a": {"parts": [{"share": "70 %"}, {"share": "30 %"}]}, "b": [1, 2]},
    ],
)
def test_entries_keep_their_order(section):
    study = {"title": "t", "links": section, "limits": {"gap": "1 mm"}}
    again = tomllib.loads(toml_text(study))
    assert again == study
    assert order(again["links"]) == order(section)


def test_a_chain_whose_plain_links_come_last_is_extended(tmp_path):
    """Each stage of its text has the same links in the same order."""
    path = tmp_path / "chain.toml"
    path.write_text(STUDY)
    run = tolstat.run(path, output=tmp_path / "chain.h5")
    extended = tolstat.extend(run.path, trials=300)
    assert extended.trials == 300
    assert [*extended.settings] == [*run.settings]
    assert extended.frame().columns.equals(run.frame().columns)
