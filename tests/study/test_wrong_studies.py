"""A wrong study is refused before anything runs: key, value, what is allowed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner

import tolstat
from tolstat.cli.main import main
from tolstat.errors import StudyError
from tolstat.study.study import load

HEAD = 'model = "stand"\ntrials = 8\nseed = 1\n'

GRID = 'model = "stand"\nsampling = "grid"\n'

UNTIL = 'model = "stand"\nseed = 1\ntrials = {{ until = "{}", at_most = 100 }}\n'

# what lies beside the study
FILES = {
    "rods.csv": "rod,length [mm]\n1,2450.1\n2,2449.9\n3,2450.2\n",
    "torn.csv": "rod,length [mm]\n1,2450.1\n# remark\n2,n.a.\n",
    "short.csv": "rod,length\n1,2450.1\n2\n",
    "german.csv": "rod;length\n1;20,001\n2;20,003\n",
    "bare.csv": "rod_length_1\n0.1\n",
    "wide.csv": f"length [mm]\n{'1' * 200_000}\n",
    "broad.csv": f"length [mm]\n{'1' * 2000}\n",
}

CHAIN = 'model = "dimension_chain"\ntrials = 8\nseed = 1\nsettings.gap = "A - B"\n'
A = 'links.A = { nominal = "50 mm", tolerance = "+-0.1 mm" }\n'

WRONG = {
    "a link without a unit": (
        CHAIN + A + 'links.B = { nominal = 49.5 }\n',
        ['[links] B = 49.5: the size has no unit', 'nominal = "49.5 mm"'],
    ),
    "a link that is a number": (
        CHAIN + A + "links.B = 49.5\n", ["[links] B = 49.5: the size has no unit"],
    ),
    "a link that the formula misspells, beside a number": (
        CHAIN.replace("A - B", "A - BB") + A + "links.BBB = 49.5\n",
        ["[links] has no BB; did you mean 'BBB'?"],
    ),
    "one name for numbered links": (
        CHAIN.replace("A - B", "A - 3*p") + A
        + "".join(f'links.p_{i} = "1 mm"\n' for i in (1, 2, 3)),
        ["[links] has no p; write p_1 + ... + p_3"],
    ),
    "a link in two sections, with a size that cannot be read": (
        CHAIN + A + 'links.B = "49 furlong"\ndeviations.B = "+-1 mm"\n',
        ["[links] B", "also given in [deviations]", "unknown unit 'furlong'"],
    ),
    "links in [settings] that are not in [links]": (
        CHAIN + A + 'settings.links.X = "1 mm"\n', ["[settings] links exists too"],
    ),
    "a contributor at the top": (
        HEAD + 'rod_length = "+-1.2 mm"\n',
        ['rod_length = "+-1.2 mm": it belongs in [deviations]', "deviations.rod_length ="],
    ),
    "a numbered contributor at the top": (
        HEAD + 'runout_7 = "IT7"\n', ['runout_7 = "IT7": it belongs in [deviations]'],
    ),
    "a response at the top": (
        HEAD + 'extra_loss = "<= 3 %"\n', ['extra_loss = "<= 3 %": it belongs in [limits]'],
    ),
    "a setting at the top": (
        HEAD + 'crank_speed = "7.5 rad/s"\n',
        ["it belongs in [settings], as settings.crank_speed = ..."],
    ),
    "a limit at the top with the name of a setting": (
        CHAIN + A + 'links.B = "49 mm"\ngap = "0.2..1 mm"\n', ["it belongs in [limits]"],
    ),
    "a formula at the top": (
        CHAIN.replace("settings.", "") + A + 'links.B = "49 mm"\n',
        ['gap = "A - B": it belongs in [settings]'],
    ),
    "a tolerance of a link at the top": (
        CHAIN + A + 'links.B = "49 mm"\nA = "+-0.1 mm"\n', ["it belongs in [links]"],
    ),
    "a grade of a part whose size is no setting": (
        'model = "ring"\ntrials = 8\nseed = 1\ndeviations.radius = "IT10"\n',
        ["radius has no nominal size", 'size = "350 mm"'],
    ),
    "unknown key of the document": (
        HEAD + '[document]\ndrawin = "A-1"\n', ["[document] drawin: ", "did you mean 'drawing'"],
    ),
    "a revision that is no text": (
        HEAD + "[document]\nrevision = 3\n", ["[document] revision = 3", "in quotes", "approval"],
    ),
    "a document in words": (HEAD + 'document = "A-1"\n', ['document = "A-1"', 'revision = "B"']),
    "unknown key": (HEAD + "trails = 9\n", ["trails", "did you mean 'trials'"]),
    "unknown model": (
        'model = "stnad"\ntrials = 8\nseed = 1\n', ['model = "stnad"', "did you mean 'stand'"],
    ),
    "missing model": ("trials = 8\nseed = 1\n", ["model: missing"]),
    "missing seed": ('model = "stand"\ntrials = 8\n', ["seed: missing", "repeatable"]),
    "missing trials": ('model = "stand"\nseed = 1\n', ["trials: missing"]),
    "no trials": ('model = "stand"\ntrials = 0\nseed = 1\n', ["trials = 0", "whole number"]),
    "half a trial": ('model = "stand"\ntrials = 1.5\nseed = 1\n', ["trials = 1.5"]),
    "trials in words": ('model = "stand"\ntrials = "many"\nseed = 1\n', ['trials = "many"']),
    "until without end": (
        'model = "stand"\nseed = 1\ntrials = { until = "extra_loss p95 +-2 %" }\n',
        ["trials = ", "at_most", "a whole number from 1"],
    ),
    "rare without a limit": (HEAD + 'sampling = "rare"\n', ['sampling = "rare"', "it needs a limit; add one to [limits]", "extra_loss, "]),
    "rare with two limits": (
        HEAD + 'sampling = "rare"\nlimits.rod_force = "<= 130 kN"\n',
        ["needs one limit, and there are 2: rod_force_1, rod_force_2", '{ rare = "rod_force_1" }'],
    ),
    "rare of what has no limit": (
        HEAD + 'sampling = { rare = "yaw" }\nlimits.rod_force = "<= 130 kN"\n', ["yaw: no limit", 'to [limits], such as extra_loss = "<= 3 %"'],
    ),
    "rare of an unknown response": (
        HEAD + 'sampling = { rare = "extra_los" }\nlimits.extra_loss = "<= 3 %"\n', ["did you mean 'extra_loss'"],
    ),
    "rare of a number": (
        HEAD + 'sampling = { rare = 3 }\nlimits.yaw = "<= 1 mrad"\n', ["a response with a limit", '{ rare = "yaw" }'],
    ),
    "unknown key of a sampling": (HEAD + 'sampling = { rar = "yaw" }\n', ["no key rar", "did you mean 'rare'"]),
    "a sampling of a number": (HEAD + "sampling = 3\n", ["sampling = 3", '{ rare = "extra_loss" }']),
    "rare with few trials": (
        HEAD + 'sampling = "rare"\ndeviations.rod_length = "+-1 mm"\nlimits.extra_loss = "<= 3 %"\n',
        ["trials = 8", "needs 5000 trials or more"],
    ),
    "rare where nothing deviates": (
        HEAD + 'sampling = "rare"\nlimits.extra_loss = "<= 3 %"\n', ["nothing deviates: no machine is rare", "give a line in [deviations]"],
    ),
    "rare until": (
        UNTIL.format("extra_loss beyond +-20 % of itself").replace("{{", "{").replace("}}", "}")
        + 'sampling = "rare"\nlimits.extra_loss = "<= 3 %"\n',
        ["trials = ", "needs a fixed number of trials; give one, such as trials = 20000, or"],
    ),
    "until of nothing": (
        'model = "stand"\nseed = 1\ntrials = { at_most = 100 }\n', ["until is missing; expected a rule or a list"],
    ),
    "unknown key of until": (UNTIL.format('extra_loss p95 +-2 %", most = "1'), ["no key most", "'at_most'"]),
    "until of an unknown response": (UNTIL.format("extra_los p95 +-2 %"), ["extra_los", "did you mean 'extra_loss'"]),
    "until of an unknown statistic": (UNTIL.format("extra_loss q95 +-2 %"), ["statistic q95", "p95 or p99.865"]),
    "until of a percentile above 100": (UNTIL.format("extra_loss p120 +-2 %"), ["statistic p120"]),
    "until without precision": (UNTIL.format("extra_loss p95"), ["a precision are expected"]),
    "until of a precision of zero": (UNTIL.format("extra_loss p95 +-0 %"), ["above zero"]),
    "until in another unit": (UNTIL.format("rod_force_1 p95 +-2 mm"), ["2 mm", "kN"]),
    "until of a share without limit": (UNTIL.format("yaw beyond +-0.1 pp"), ["yaw beyond", "has no limit"]),
    "until of a share in per cent": (
        UNTIL.format("extra_loss beyond +-0.1 %") + '[limits]\nextra_loss = "<= 3 %"\n',
        ["is ambiguous", "pp"],
    ),
    "until of a latin hypercube": (
        UNTIL.format("extra_loss p95 +-2 %") + 'sampling = "latin"\n', ["needs a fixed number of trials", "sobol"],
    ),
    "until of a grid": (
        GRID + 'trials = { until = "yaw p95 +-2 %", at_most = 9 }\n[grid]\ncrank_difference = ["0 mm"]\n',
        ["samples nothing"],
    ),
    "saltelli of half a group": (
        HEAD + 'sampling = "saltelli"\n[deviations]\nrod_length = "+-1 mm"\nfriction = "+-9 %"\n',
        ["trials = 8", "a multiple of 5", "5 or 10"],
    ),
    "saltelli of correlated parts": (
        HEAD + 'sampling = "saltelli"\n[deviations]\nrod_length = "+-1 mm"\n[correlation]\n'
        "rod_length_1 = { rod_length_2 = 0.5 }\n",
        ["[correlation]", "independent"],
    ),
    "negative seed": ('model = "stand"\ntrials = 8\nseed = -1\n', ["seed = -1"]),
    "unknown sampling": (HEAD + 'sampling = "rnadom"\n', ["sampling", "'random'"]),
    "unknown setting": (
        HEAD + '[settings]\ncrank_sped = "7.5 rad/s"\n', ["crank_sped", "'crank_speed'"],
    ),
    "hertz": (HEAD + '[settings]\ncrank_speed = "7.5 Hz"\n', ["crank_speed", "rpm"]),
    "per minute": (HEAD + '[settings]\ncrank_speed = "72 1/min"\n', ["72 1/min", "rpm"]),
    "speed without unit": (
        HEAD + "[settings]\ncrank_speed = 7.5\n", ["crank_speed = 7.5", "with its unit"],
    ),
    "speed of zero": (
        HEAD + '[settings]\ncrank_speed = "0 rad/s"\n', ["crank_speed", "above 0"],
    ),
    "unknown choice": (
        HEAD + '[settings]\nvariant = "equalised"\n', ["variant", "'equalized'"],
    ),
    "half a cycle": (HEAD + "[settings]\ncycles = 1.5\n", ["cycles = 1.5", "whole"]),
    "no cycle": (HEAD + "[settings]\ncycles = 0\n", ["cycles = 0", "at least 1"]),
    "word for a number": (HEAD + '[settings]\nrtol = "fine"\n', ["rtol", "a number"]),
    "contact yaw in words": (
        HEAD + '[settings]\ncontact_yaw = "small"\n', ["contact_yaw", "cannot be read"],
    ),
    "unknown contributor": (
        HEAD + '[deviations]\nrod_lenght = "+-1 mm"\n',
        ["[deviations] rod_lenght", '"+-1 mm"', "'rod_length'"],
    ),
    "wrong unit": (
        HEAD + '[deviations]\nrod_length = "+-1 kg"\n', ["rod_length", "'kg'", "mm"],
    ),
    "angle without unit": (
        HEAD + '[deviations]\ncrank_angle = "+-0.01"\n', ["crank_angle", "unit is missing"],
    ),
    "length for a relative one": (
        HEAD + '[deviations]\nfriction = "+-1 mm"\n', ["friction", "plain number"],
    ),
    "negative tolerance": (
        HEAD + '[deviations]\nrod_length = "+--1.2 mm"\n', ["rod_length", "not negative"],
    ),
    "tolerance upside down": (
        HEAD + '[deviations]\nrod_length = "0.3..-0.1 mm"\n', ["rod_length", "lower end"],
    ),
    "decimal comma": (
        HEAD + '[deviations]\nrod_length = "+-1,200 mm"\n', ["rod_length", "1.200 or 1200"],
    ),
    "unknown distribution": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", distribution = "gauss" }\n',
        ["rod_length", "'gauss'", "normal"],
    ),
    "key of another distribution": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "uniform", cp = 1.33 }\n',
        ["rod_length", "uniform distribution has no key cp"],
    ),
    "shift outside": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", shift = "2 mm" }\n',
        ["rod_length", "outside the tolerance"],
    ),
    "cp of zero": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", cp = 0 }\n',
        ["rod_length", "above zero"],
    ),
    "mode outside": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "triangular", mode = "3 mm" }\n',
        ["rod_length", "outside the tolerance"],
    ),
    "no tolerance": (HEAD + "[deviations]\nrod_length = { cp = 1 }\n", ["tolerance is missing"]),
    "number for a tolerance": (
        HEAD + "[deviations]\nrod_length = 1.2\n", ["rod_length = 1.2", "+-1.2 mm"],
    ),
    "given twice": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\nrod_length_1 = "+-2 mm"\n',
        ["rod_length_1", "is given twice"],
    ),
    "unknown response": (
        HEAD + '[limits]\nextra_los = "<= 3 %"\n', ["[limits] extra_los", "'extra_loss'"],
    ),
    "limit upside down": (
        HEAD + '[limits]\nrod_force = "180..20 kN"\n', ["rod_force", "lower end of a range comes first"],
    ),
    "limit of another kind": (
        HEAD + '[limits]\nrod_force = "<= 3 %"\n', ["rod_force", "kN"],
    ),
    "limit without sign": (HEAD + '[limits]\nextra_loss = "3 %"\n', ["extra_loss", "<= 3"]),
    # distributions
    "truncated without a word": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "truncated_normal" }\n',
        ["rod_length", "needs the key outside: screened or clipped"],
    ),
    "truncated with a wrong word": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "truncated_normal", outside = "reworked" }\n',
        ["rod_length", "allowed: screened, clipped"],
    ),
    "plateau outside": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "trapezoidal", plateau = "+-2 mm" }\n',
        ["rod_length", "plateau lies outside"],
    ),
    "beta without beta": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "beta", alpha = 2 }\n',
        ["rod_length", "needs the key beta"],
    ),
    "lognormal from the wrong side": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "lognormal", median = "-1 mm" }\n',
        ["rod_length", "median lies outside"],
    ),
    "weibull shape in words": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "weibull", shape = "round" }\n',
        ["rod_length", "shape: a number"],
    ),
    "student without degrees of freedom": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "student_t" }\n',
        ["rod_length", "needs the key degrees_of_freedom"],
    ),
    "student of three readings": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "student_t", degrees_of_freedom = 2 }\n',
        ["rod_length", "degrees_of_freedom = 2: at least 3"],
    ),
    "constant with a tolerance": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", distribution = "constant", value = "1 mm" }\n',
        ["rod_length", "constant distribution has no tolerance"],
    ),
    "constant of another kind": (
        HEAD + "[deviations]\nrod_length = "
        '{ distribution = "constant", value = "1 deg" }\n',
        ["rod_length", "'deg' is of another kind"],
    ),
    # measured parts
    "no such data": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rod.csv", column = "length", unit = "mm" }\n',
        ["rod_length", "rod.csv: no such file", "'rods.csv'"],
    ),
    "wrong column": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "lenght", unit = "mm" }\n',
        ["rod_length", "no column 'lenght'", "did you mean 'length'"],
    ),
    "column without unit": (
        HEAD + '[deviations]\nrod_length = { data = "rods.csv", column = "rod" }\n',
        ["rod_length", "unit is missing"],
    ),
    "column of another unit": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "length", unit = "um" }\n',
        ["rod_length", "column length in mm, the study in um"],
    ),
    "column of another kind": (
        HEAD + "[deviations]\ncrank_angle = "
        '{ data = "rods.csv", column = "length", unit = "mm" }\n',
        ["crank_angle", "'mm' is of another kind"],
    ),
    "a cell that is no number": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "torn.csv", column = "length", unit = "mm" }\n',
        ["rod_length", "torn.csv, line 4, column length: 'n.a.' is not a number"],
    ),
    "a row too short": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "short.csv", column = "length", unit = "mm" }\n',
        ["rod_length", "short.csv, line 3: 1 cells under 2 heads"],
    ),
    "a decimal comma or thousands": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "german.csv", column = "length", unit = "mm" }\n',
        ["rod_length", "line 2, column length: '20,001' may be 20001 or 20.001", 'decimal = ","'],
    ),
    "unknown fit": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "length", unit = "mm", fit = "weibull" }\n',
        ["rod_length", 'fit = "weibull"', "normal, lognormal"],
    ),
    "a nominal size in another unit": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "length", nominal = "2450 um" }\n',
        ["nominal = '2450 um'", "rod_length_1 is nominally 2450 mm", "leave nominal out"],
    ),
    "too few to fit": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "length", unit = "mm", nominal = "2450 mm", fit = "normal" }\n',
        ["rod_length", "3 parts are too few"],
    ),
    "key of measured parts": (
        HEAD + "[deviations]\nrod_length = "
        '{ data = "rods.csv", column = "length", unit = "mm", cp = 1 }\n',
        ["rod_length", "measured parts have no key cp"],
    ),
    # together
    "correlation above 1": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        "[correlation]\nrod_length_1 = { rod_length_2 = 1.2 }\n",
        ["[correlation] rod_length_1", "between -1 and 1", "rank correlation 1.2: a number between -1 and 1"],
    ),
    "correlation in words": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        '[correlation]\nrod_length_1 = { rod_length_2 = "strong" }\n',
        ["[correlation] rod_length_1", "expected a table of rank correlations"],
    ),
    "correlation with itself": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        "[correlation]\nrod_length_1 = { rod_length_1 = 0.2 }\n",
        ["[correlation] rod_length_1", "with itself"],
    ),
    "correlation of nothing": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        "[correlation]\nrod_length_1 = { friction = 0.2 }\n",
        ["[correlation] rod_length_1", "friction does not deviate"],
    ),
    "correlation of nobody": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        "[correlation]\nrod_length_1 = { frictoin = 0.2 }\n",
        ["[correlation] rod_length_1", "did you mean 'friction'"],
    ),
    "correlation given twice": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\n'
        "[correlation]\nrod_length_1 = { rod_length_2 = 0.2 }\n"
        "rod_length_2 = { rod_length_1 = 0.3 }\n",
        ["[correlation] rod_length_2", "is given twice"],
    ),
    "not positive definite": (
        HEAD + '[deviations]\nrod_length = "+-1 mm"\nfriction = "+-5 %"\n'
        "[correlation]\nrod_length_1 = { rod_length_2 = 0.9, friction = -0.9 }\n"
        "rod_length_2 = { friction = 0.9 }\n",
        ["[correlation]", "not positive definite", "rod_length_1 with friction (-0.9)"],
    ),
    "common with one part": (
        HEAD + "[deviations]\nfriction = "
        '{ tolerance = "+-5 %", common = true }\n',
        ["friction", "is one part"],
    ),
    "common of twice": (
        HEAD + "[deviations]\nrod_length = "
        '{ tolerance = "+-1 mm", common = 2 }\n',
        ["rod_length", "at most 1"],
    ),
    "common and correlated": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", common = true }\n'
        "[correlation]\nrod_length_1 = { rod_length_2 = 0.2 }\n",
        ["[correlation] rod_length_1", "belongs to a batch"],
    ),
    # grades
    "grade of an angle": (
        HEAD + '[deviations]\ncrank_angle = "IT7"\n',
        ["crank_angle", "IT7 is of lengths", "rad"],
    ),
    "grade of a share": (
        HEAD + '[deviations]\nfriction = "IT7"\n', ["friction", "is of lengths"],
    ),
    "grade without a size": (
        HEAD + '[deviations]\ntooth_position = "IT7"\n',
        ["tooth_position", "no nominal size", 'size = "350 mm"'],
    ),
    "grade of too great a size": (
        HEAD + '[deviations]\nrod_length = { tolerance = "IT7", size = "3.2 m" }\n',
        ["rod_length", "ends at 3150 mm"],
    ),
    "grade of a length in degrees": (
        HEAD + '[deviations]\nrod_length = { tolerance = "IT7", size = "30 deg" }\n',
        ["rod_length", "'deg' is of another kind"],
    ),
    "grade that does not exist": (
        HEAD + '[deviations]\nrod_length = "IT19"\n', ["rod_length", "IT1 to IT18"],
    ),
    "position that is not known": (
        HEAD + '[deviations]\nrod_length = "i6"\n', ["rod_length", "without i, l, o, q and w"],
    ),
    "size without a grade": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", size = "1 m" }\n',
        ["rod_length", "size belongs to a grade"],
    ),
    "class without a module": (
        HEAD + "[deviations]\nrunout = { iso1328 = 7 }\n",
        ["runout", "ISO 1328-1:2013", "module"],
    ),
    "class of a rod": (
        HEAD + '[deviations]\nrod_length = { iso1328 = 7, module = "12 mm" }\n',
        ["rod_length", "run-out and the pitch of gears"],
    ),
    "class that does not exist": (
        HEAD + '[deviations]\nrunout = { iso1328 = 12, module = "12 mm" }\n',
        ["runout", "classes 1 to 11"],
    ),
    "class and tolerance": (
        HEAD + "[deviations]\n"
        'runout = { iso1328 = 7, module = "12 mm", tolerance = "0..1 mm" }\n',
        ["runout", "give one"],
    ),
    # grids and tables
    "grid of nothing": (GRID, ["[grid]: missing"]),
    "grid of zero points": (
        GRID + '[grid]\ncrank_difference = { from = "0 mm", to = "3 mm", points = 0 }\n',
        ["[grid] crank_difference", "points = 0: expected a whole number from 2"],
    ),
    "grid of no list": (
        GRID + "[grid]\ncrank_difference = []\n",
        ["[grid] crank_difference", "values are expected"],
    ),
    "grid without an end": (
        GRID + '[grid]\ncrank_difference = { from = "0 mm", points = 6 }\n',
        ["[grid] crank_difference", "from, to and points"],
    ),
    "grid without width": (
        GRID + '[grid]\ncrank_difference = { from = "1 mm", to = "1 mm", points = 6 }\n',
        ["[grid] crank_difference", "the same"],
    ),
    "grid of bare numbers": (
        GRID + "[grid]\ncrank_difference = [0, 1]\n",
        ["[grid] crank_difference", "unit is missing"],
    ),
    "grid of nobody": (
        GRID + '[grid]\ncrank_diference = ["0 mm"]\n',
        ["[grid] crank_diference", "neither a contributor nor a setting", "'crank_difference'"],
    ),
    "grid of a wrong setting": (
        GRID + '[grid]\ncrank_speed = ["7 Hz"]\n', ["[grid] crank_speed", "rpm"],
    ),
    "grid of a wrong word": (
        GRID + '[grid]\nvariant = ["equalised"]\n', ["[grid] variant", "'equalized'"],
    ),
    "grid of a setting that is set": (
        GRID + '[settings]\ncrank_speed = "7 rad/s"\n[grid]\ncrank_speed = ["8 rad/s"]\n',
        ["[grid] crank_speed", "is also in [settings]"],
    ),
    "grid of one part twice": (
        GRID + '[grid]\nrod_length = ["0 mm"]\nrod_length_1 = ["1 mm"]\n',
        ["[grid] rod_length_1", "is given twice"],
    ),
    "grid too fine": (
        GRID + '[grid]\nrod_length_1 = { from = "0 mm", to = "1 mm", points = 9999 }\n'
        'rod_length_2 = { from = "0 mm", to = "1 mm", points = 9999 }\n',
        ["[grid]", "points; at most"],
    ),
    "grid with random parts": (
        GRID + '[grid]\ncrank_difference = ["0 mm"]\n[deviations]\nfriction = "+-5 %"\n',
        ["[deviations] friction", 'only distribution = "constant"'],
    ),
    "grid of a constant part": (
        GRID + '[grid]\nfriction = ["5 %"]\n'
        '[deviations]\nfriction = { distribution = "constant", value = "5 %" }\n',
        ["[deviations] friction", "is also in [grid]"],
    ),
    "grid with trials": (
        GRID + 'trials = 5\nseed = 1\n[grid]\ncrank_difference = ["0 mm"]\n',
        ["trials = 5", "samples nothing", "seed = 1"],
    ),
    "grid of random trials": (
        HEAD + '[grid]\ncrank_difference = ["0 mm"]\n', ["grid", 'sampling = "grid"'],
    ),
    "table without a name": (
        'model = "stand"\nsampling = "table"\n', ["table: missing", "machines.csv"],
    ),
    "table of random trials": (
        HEAD.replace("trials", 'table = "rods.csv"\ntrials'), ['sampling = "table"'],
    ),
    "table of nobody": (
        'model = "stand"\nsampling = "table"\ntable = "rods.csv"\n',
        ["rods.csv, column rod: unknown", "rod_length"],
    ),
    "table without a unit": (
        'model = "stand"\nsampling = "table"\ntable = "bare.csv"\n',
        ["bare.csv, column rod_length_1", "unit is missing"],
    ),
    "reference without a label": (
        GRID + '[grid]\ncrank_difference = ["0 mm"]\n[reference]\ndata = "rods.csv"\n',
        ["[reference]", "label is missing"],
    ),
    "reference of another axis": (
        GRID + '[grid]\ncrank_difference = ["0 mm"]\n'
        '[reference]\ndata = "rods.csv"\nlabel = "x"\n',
        ["[reference]", "'rod', must be swept"],
    ),
    # what no computer, file or folder can hold
    "seed of 71 bits": (f'model = "stand"\ntrials = 8\nseed = {2**70}\n', ["seed = 1180591620717411303424", "18446744073709551615"]),
    "seed of 5000 digits": ('model = "stand"\ntrials = 8\nseed = ' + "9" * 5000, ["seed = 999", "thousands of digits"]),
    "NUL in a title": (HEAD + 'title = "a\\u0000b"\n', ["title: a text contains the character NUL"]),
    "3000 brackets": (HEAD + "x = " + "[" * 3000 + "]" * 3000, ["x = [[[", "more than 16 tables or lists"]),
    "100 brackets": (HEAD + "[settings]\nrtol = " + "[" * 100 + "]" * 100, ["[settings] rtol", "more than 16 tables or lists"]),
    "100 tables": (HEAD + "a." * 100 + "b = 1\n", ["a.a.a.a", "more than 16 tables or lists"]),
    "a hundred thousand tables": (HEAD + "a." * 100_000 + "b = 1\n", ["a.a.a.a", "more than 16 tables or lists"]),
    "a thousand keys": (HEAD + "".join(f"k{i} = 1\n" for i in range(1000)), ["k49", "there are more"]),
    "long text": (HEAD + f'title = "{"a" * 20_000}"\n', ["title: a text has 20000 characters"]),
    "long key": (HEAD + f"{'a' * 300} = 1\n", ["a key has 300 characters"]),
    "long unit": (HEAD + f'[limits]\nyaw = "<= 1 {"m " * 100}"\n', ["yaw", "not a unit: 199 characters"]),
    "endless cycles": (HEAD + "[settings]\ncycles = inf\n", ["[settings] cycles = inf", "finite"]),
    "no number of cycles": (HEAD + "[settings]\ncycles = nan\n", ["[settings] cycles = nan", "finite"]),
    "too many cycles": (HEAD + "[settings]\ncycles = 1e30\n", ["cycles = 1e30", "at most 9.0", "turns in the window"]),
    "cycles of 400 digits": (HEAD + f"[settings]\ncycles = 1{'0' * 400}\n", ["[settings] cycles = 1000", "at most 1e+100"]),
    "common to a list": (HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", common = [1] }\n', ["rod_length", "common: true is expected"]),
    "common to a day": (HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", common = 1979-05-27 }\n', ["rod_length", "common: true is expected"]),
    "trials of a week": ('model = "stand"\nseed = 1\ntrials = 20_000_000_000\n', ["trials = 20000000000: ", "GB of memory", "231 days", "give at most about"]),
    "trials of ages": (f'model = "stand"\nseed = 1\ntrials = 1{"0" * 26}\n', ["trials = 1000", "GB of memory", "years"]),
    "ages until": (
        'model = "stand"\nseed = 1\ntrials = { until = "yaw mean +-2 %", at_most = 1000000000000 }\n',
        ["trials = 1000000000000", "GB of memory"],
    ),
    "grid of 1e14 points": (
        GRID + '[grid]\ncrank_difference = { from = "0 mm", to = "3 mm", points = 100000000000000 }\n',
        ["[grid] crank_difference", "at most 10000000"],
    ),
    "grid of too many settings": (
        GRID + '[grid]\ncrank_speed = { from = "1 rad/s", to = "3 rad/s", points = 20000 }\n',
        ["[grid]: 20000 combinations of settings", "10000"],
    ),
    "weibull without end": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", distribution = "weibull", shape = 0.002 }\n',
        ["rod_length", "shape 0.002", "cannot be computed: it is too wide"],
    ),
    "beta of infinity": (
        HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", distribution = "beta", alpha = inf, beta = 1 }\n',
        ["[deviations] rod_length, alpha = inf", "finite"],
    ),
    "infinite cp": (HEAD + '[deviations]\nrod_length = { tolerance = "+-1 mm", cp = inf }\n', ["rod_length, cp = inf", "finite"]),
    "limit beyond numbers": (HEAD + '[limits]\nrod_force = "<= 1e308 kN"\n', ["rod_force", "1e308 is too large"]),
    "limit beyond numbers in SI": (HEAD + '[limits]\nrod_force = "<= 1e98 kN"\n', ["rod_force", "1e98 is too large: in SI"]),
    "tolerance below numbers": (HEAD + '[deviations]\nrod_length = "+-1e-320 m"\n', ["rod_length", "too small"]),
    "ppk of 400 digits": (HEAD + f'[limits]\nyaw = {{ limit = "<= 1 mrad", ppk = 1{"0" * 400} }}\n', ["[limits] yaw, ppk", "at most 1e+100"]),
    "a cell of 200 kB": (
        HEAD + '[deviations]\nrod_length = { data = "wide.csv", column = "length" }\n',
        ["rod_length", "wide.csv, line 2: field larger than"],
    ),
    "a cell of 2 kB": (
        HEAD + '[deviations]\nrod_length = { data = "broad.csv", column = "length" }\n',
        ["rod_length", "broad.csv, line 2: a cell has 2000 characters"],
    ),
    "data without end": (
        HEAD + '[deviations]\nrod_length = { data = "/dev/zero", column = "length" }\n',
        ["rod_length", "/dev/zero lies outside the folder of the study"],
    ),
    "data above": (
        HEAD + '[deviations]\nrod_length = { data = "../rods.csv", column = "length" }\n',
        ["rod_length", "../rods.csv lies outside"],
    ),
    "a link to data elsewhere": (
        HEAD + '[deviations]\nrod_length = { data = "link.csv", column = "length" }\n',
        ["rod_length", "link.csv lies outside"],
    ),
    "a pipe": (
        HEAD + '[deviations]\nrod_length = { data = "pipe.csv", column = "length" }\n',
        ["rod_length", "pipe.csv is a folder or a device"],
    ),
    "a folder": (
        HEAD + '[deviations]\nrod_length = { data = ".", column = "length" }\n', ["rod_length", "is a folder or a device; a file is expected"],
    ),
    "a table without end": ('model = "stand"\nsampling = "table"\ntable = "/dev/zero"\n', ["table", "lies outside"]),
    "a reference elsewhere": (
        GRID + '[grid]\ncrank_difference = ["0 mm"]\n[reference]\ndata = "/etc/passwd"\nlabel = "x"\n',
        ["[reference]", "/etc/passwd lies outside"],
    ),
    # machines that cannot be
    "no machine without deviations": (
        'model = "dimension_chain"\ntrials = 8\nseed = 1\n[settings]\ngap = "sqrt(A - B)"\n'
        '[links]\nA = "1 mm"\nB = "2 mm"\n',
        ["[settings]", "root of less than nothing"],
    ),
    "no TOML": ("model = stand\n", ["not a TOML file", "line 1"]),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_wrong_studies(name, tmp_path):
    text, words = WRONG[name]
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    for file, content in FILES.items():
        (tmp_path / file).write_text(content)
    (tmp_path / "link.csv").symlink_to("/etc/passwd")
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(StudyError) as refused:
        load(path)
    for word in (str(path), *words):
        assert word in str(refused.value)
    # on the command line: exit code 2, the sentence, no traceback, no file
    shown = CliRunner().invoke(main, ["run", str(path)])
    assert shown.exit_code == 2
    assert words[0] in shown.stderr and "Traceback" not in shown.output
    assert not path.with_suffix(".h5").exists()


def test_all_problems_are_reported_at_once(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(
        HEAD
        + '[settings]\ncycles = 0\n[deviations]\nrod = "1"\n[limits]\nyaw = "1 mm"\n'
    )
    with pytest.raises(StudyError) as refused:
        load(path)
    assert str(refused.value).count("\n") == 3


def test_a_missing_file_names_the_nearest():
    with pytest.raises(StudyError, match=r"did you mean .*khpt75\.toml"):
        load("runs/khpt57.toml")
    with pytest.raises(StudyError, match="a stored run"):
        load("runs/khpt75.h5")


def test_settings_and_presets(tmp_path):
    path = tmp_path / "right.toml"
    path.write_text(
        HEAD
        + '[settings]\ncrank_speed = "60 rpm"\ncontact_yaw = "fig4"\nmax_step = "0.5 ms"\n'
        + 'cycles = 3\nvariant = "equalized"\n[limits]\nrod_force = "<= 130 kN"\n'
    )
    study = load(path, trials=5, seed=9)
    assert study.settings.crank_speed == pytest.approx(6.283185307179586)
    assert study.settings.contact_yaw == 5.8e-4
    assert (study.settings.max_step, study.settings.cycles) == (5e-4, 3)
    assert (study.trials, study.seed) == (5, 9)
    assert sorted(study.limits) == ["rod_force_1", "rod_force_2"]


@pytest.mark.parametrize("path", sorted(Path("runs").glob("*.toml")), ids=str)
def test_shipped_studies_are_valid(path):
    assert load(path).trials > 0


def test_problems_of_all_kinds_are_reported_at_once(tmp_path):
    """A wrong type, an unknown name, a unit, a limit: one pass."""
    path = tmp_path / "wrong.toml"
    path.write_text(
        'model = "stand"\ntrials = "16"\nsede = 1\n[settings]\ncrank_speed = "7 mm"\n'
        '[deviations]\nrod_lenght = "+-1 mm"\ncrank_radius = 5\nrunout = "+-1 N"\n'
        '[limits]\nextra_loss = "3 %"\nlost = "<= 1 %"\n'
    )
    with pytest.raises(StudyError) as raised:
        load(path)
    said = str(raised.value)
    for each in (
        'trials = "16": expected a whole number', "sede: a study has no such key",
        "[settings] crank_speed", "[deviations] rod_lenght", "[deviations] crank_radius",
        "[deviations] runout", "[limits] extra_loss", "[limits] lost", "seed: missing",
    ):  # fmt: skip
        assert said.count(each) == 1, (each, said)
    assert "trials: missing" not in said


def test_problems_of_links_and_sampling_hide_no_others(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(
        'model = "dimension_chain"\nsampling = "latn"\ntitel = "x"\n'
        '[settings]\ngap = "A - B"\nworst = "no"\n[links]\n'
        'A = { nominal = "50 mm", tolerance = "+-0.1 kN" }\nB = { tolerance = "h7" }\n'
    )
    with pytest.raises(StudyError) as raised:
        load(path)
    wrong = ("titel:", 'sampling = "latn"', "[links] B", "[settings] worst", "seed:",
             "trials: missing")  # fmt: skip
    for each in wrong:
        assert str(raised.value).count(f"  {each}") == 1, (each, str(raised.value))
    text = path.read_text().replace("B = {", 'B = { nominal = "49 mm",')
    path.write_text(text.replace('worst = "no"', "") + '[limits]\ngap = "<= 1 kg"\n')
    with pytest.raises(StudyError) as raised:
        load(path)
    wrong = ("titel:", 'sampling = "latn"', "[links] A", "[limits] gap", "seed:",
             "trials: missing")  # fmt: skip
    for each in wrong:
        assert str(raised.value).count(f"  {each}") == 1, (each, str(raised.value))


def test_a_grade_takes_its_size_from_a_setting():
    """IT10 of a thickness of 80 mm is 0.12 mm wide, of 100 mm 0.14 mm."""
    study = {"model": "ring", "trials": 8, "seed": 1}
    study["deviations"] = {"thickness": "IT10"}
    for size, width in (("80 mm", 0.12e-3), ("100 mm", 0.14e-3)):
        found = load({**study, "settings": {"thickness": size}})
        zone = found.deviating.distributions["thickness"].tolerance
        assert zone == pytest.approx((-width / 2, width / 2))


def test_all_misspelt_keys_are_named_though_the_model_is_missing():
    with pytest.raises(StudyError) as raised:
        load({"modle": "stand", "trial": 4, "limit": {"yaw": "<= 1 rad"}})
    said = str(raised.value)
    assert all(
        each in said for each in ("model: missing", "modle:", "trial:", "limit:")
    )


def test_a_wrong_limit_of_a_rare_study_is_one_problem():
    study = {"model": "stand", "sampling": "rare", "trials": 5000, "seed": 1}
    study |= {"deviations": {"rod_length": "+-1 mm"}, "limits": {"gapp": "<= 1 mm"}}
    with pytest.raises(StudyError) as raised:
        load(study)
    assert "gapp" in str(raised.value) and "sampling" not in str(raised.value)


def test_a_long_list_of_what_is_allowed_is_given_once(tmp_path):
    path = tmp_path / "ring.toml"
    unknown = "\n".join(f"k{i} = 0" for i in range(20))
    path.write_text(f'model = "ring"\ntrials = 9\n[settings]\n{unknown}\n')
    with pytest.raises(StudyError) as refused:
        load(path)
    said = str(refused.value)
    assert said.count("no such setting") == 20
    assert said.count("allowed:") == 1 and len(said) < 4000


def test_a_torque_of_a_model_that_is_not_known_is_read():
    table = {"model": "hoist", "trials": 8, "seed": 1, "deviations": {"T": "+-15 N m"}}
    with pytest.raises(StudyError, match="no model is called 'hoist'") as caught:
        load(table)
    assert "of another kind" not in str(caught.value)


@pytest.mark.parametrize("call", [tolstat.run, tolstat.decide])
def test_a_study_is_a_path_or_a_mapping(call):
    with pytest.raises(StudyError, match=r"not the text .* tomllib\.loads\(text\)"):
        call('model = "stand"\nseed = 1\n')
    for wrong in (3, None, b"study.toml"):
        with pytest.raises(StudyError, match="a path or a mapping is expected, not "):
            call(wrong)
