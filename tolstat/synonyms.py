"""The field's other words for names of tolstat, proposed where one is typed.

Keys are in small letters, with _ for a hyphen or a space. Each name is followed by what
to add, if anything. A name is proposed only where it is allowed.
"""

from collections.abc import Mapping, Sequence

Named = Sequence[str]
RAYLEIGH, EXPONENTIAL = "weibull, with shape = 2", "weibull, with shape = 1"
ENDS = 'tolerance, such as "+0.1..+0.3 mm"'
RANGE = 'limit, such as "1..3 mm"'
MEAN = ("shift", "nominal_shift")
POWER = "**, such as a**2"

# names by word
_WORDS: Mapping[Named, Named] = {
    # distributions
    ("rectangular", "rectangle", "rect", "equal", "flat", "box"): ("uniform",),
    ("gauss", "gaussian", "norm", "bell"): ("normal",),
    ("log_normal", "logn", "galton"): ("lognormal",),
    ("triangle", "tri", "simpson"): ("triangular",),
    ("trapezoid", "trapezium", "trap", "trapez"): ("trapezoidal",),
    ("rayleigh",): (RAYLEIGH,),
    ("exponential", "expon"): (EXPONENTIAL, "exp"),
    ("u_shaped", "sine", "sinusoidal"): ("arcsine",),
    ("fixed", "const", "deterministic", "exact", "point"): ("constant",),
    ("truncated", "truncnorm", "trunc", "truncated_gauss", "truncated_gaussian",
     "screened", "sorted"): ("truncated_normal",),
    ("pert", "beta_pert"): ("beta",),
    ("t", "student", "students_t", "student's_t", "t_distribution"): ("student_t",),
    # keys of a deviation
    ("tol", "tols", "tolerances", "zone", "plus_minus", "range", "grade", "it",
     "iso286", "t"): ("tolerance",),
    ("std", "stdev", "std_dev", "stddev", "sd", "standard_deviation"): ("sigma",),
    ("lower", "upper", "min", "max", "low", "high", "lsl", "usl", "from", "to"): (
        RANGE, ENDS,
    ),
    ("mu", "loc", "location", "average"): ("mean",),
    ("bias", "offset", "mean_shift"): MEAN,
    ("dist", "distr", "type", "kind", "law", "pdf"): ("distribution",),
    ("peak", "most_likely"): ("mode",),
    ("a",): ("alpha",),
    ("b",): ("beta",),
    ("k", "c"): ("shape",),
    ("df", "dof", "nu", "ndf", "freedom"): ("degrees_of_freedom",),
    ("batch", "lot", "shared"): ("common",),
    ("costs",): ("cost",),
    ("csv", "file", "parts", "sample"): ("data", "table"),
    ("nom", "basic", "basic_size", "dimension"): ("nominal", "size"),
    ("cpk", "pp", "cp"): ("ppk",),
    ("ppk", "pp"): ("cpk", "cp"),
    ("dpmo", "dpm"): ("ppm",),
    # keys and sections of a study
    ("tolerances", "tolerance", "tol", "deviation", "contributors", "contributor",
     "inputs", "input", "variables", "variable", "variations", "uncertainties",
     "distributions", "distribution"): ("deviations",),
    ("tolerances", "tolerance", "link", "chain", "loop", "stack", "stackup", "stack_up",
     "dimensions", "dims", "parts", "nominal", "nominals", "sizes"): ("links",),
    ("limit", "specs", "spec", "specification", "specifications", "requirement",
     "requirements", "constraints", "outputs", "output", "targets", "criteria"): (
        "limits",
    ),
    ("correlations", "corr", "correlated", "covariance", "dependence", "copula"): (
        "correlation",
    ),
    ("setting", "options", "option", "config", "parameters", "parameter", "params",
     "constants", "solver"): ("settings",),
    ("n", "n_trials", "ntrials", "samples", "n_samples", "sample_size", "runs",
     "iterations", "simulations", "shots", "draws"): ("trials",),
    ("random_seed", "random_state", "rng", "entropy"): ("seed",),
    ("sampler", "design", "doe", "sampling_method", "method"): ("sampling",),
    ("name", "heading", "description", "comment"): ("title",),
    ("machine",): ("model",),
    ("sweep", "axes", "scan"): ("grid",),
    ("meta", "metadata", "header", "title_block"): ("document",),
    ("drawing_number", "part_number", "drawing_no"): ("drawing",),
    ("approved_by", "approved", "approver"): ("approval",),
    ("engineer", "created_by", "designer"): ("author",),
    ("rev", "version", "issue"): ("revision",),
    ("formula", "expression", "equation", "closing_link", "clearance"): ("gap",),
    ("dt", "step", "h_max", "hmax", "step_size"): ("max_step",),
    ("tol", "tolerance", "accuracy", "reltol", "rel_tol", "relative_tolerance"): (
        "rtol",
    ),
    # samplings
    ("monte_carlo", "mc", "mcs", "montecarlo", "iid"): ("random",),
    ("lhs", "latin_hypercube", "latin_hypercube_sampling"): ("latin",),
    ("qmc", "quasi", "halton", "quasi_monte_carlo"): ("sobol",),
    ("importance", "importance_sampling", "subset", "subset_simulation", "tail"): (
        "rare",
    ),
    ("factorial", "full_factorial", "sweep", "scan"): ("grid",),
    ("csv", "file", "list", "data"): ("table",),
    # commands
    ("simulate", "sim", "start", "execute", "solve", "calculate", "calc"): ("run",),
    ("optimize", "optimise", "optimization", "synthesize", "synthesis", "minimize"): (
        "allocate",
    ),
    ("plot", "draw", "info", "status", "inspect", "print", "summary"): ("show",),
    ("replay", "rerun", "repeat"): ("trial",),
    ("init", "create", "template"): ("new",),
    ("whatif", "scenario", "relimit"): ("what-if",),
    ("ls", "list", "history"): ("runs",),
    ("continue", "restart", "repair"): ("resume",),
    ("append", "add", "more"): ("extend",),
    ("html", "pdf", "page"): ("report",),
    ("csv", "excel", "xlsx", "dump", "save"): ("export",),
    ("diff",): ("compare",),
    ("diagnose", "audit"): ("doctor",),
    ("validate", "test", "judge"): ("check",),
    ("machines", "catalogue", "catalog"): ("models",),
    # functions of a formula
    ("arctan", "atn", "arctg"): ("atan",),
    ("arcsin",): ("asin", "arcsine"),
    ("arccos",): ("acos",),
    ("arctan2", "angle"): ("atan2",),
    ("ln", "log_e"): ("log",),
    ("log10", "lg"): ("log, as log(x) / log(10)",),
    ("log2",): ("log, as log(x) / log(2)",),
    ("pow", "power", "square", "sqr", "^"): (POWER,),
    ("root", "squareroot", "square_root"): ("sqrt",),
    ("fabs", "absolute", "mod", "betrag"): ("abs",),
    ("minimum",): ("min",),
    ("maximum",): ("max",),
    ("tg",): ("tan",),
    ("sind",): ('sin, of a link in "deg"',),
    ("cosd",): ('cos, of a link in "deg"',),
    ("tand",): ('tan, of a link in "deg"',),
    ("norm", "length", "distance"): ("hypot",),
}  # fmt: skip


def names_of(word: str, allowed: Sequence[str]) -> list[tuple[str, str]]:
    """Return allowed names that a word of the field stands for, and what to add."""
    # a function of a module is meant by its own name: np.arctan, math.log10
    plain = word.strip().casefold().replace("-", "_").replace(" ", "_")
    plain = plain.rpartition(".")[2]
    same = [name for name in allowed if name.casefold() == plain]
    meant = [n for words, names in _WORDS.items() if plain in words for n in names]
    parts = [(name, name.partition(",")[0]) for name in same or dict.fromkeys(meant)]
    return [(name, full.removeprefix(name)) for full, name in parts if name in allowed]
