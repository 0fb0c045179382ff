"""Rates of change of a graph's nodes along a motion."""

from collections.abc import Mapping

from tolstat.lanes.graph import Node, Value, in_order


def slope(quantity: Value, rates: Mapping[str, Value]) -> Value:
    """Return the derivative by time of a quantity, with the rates of the states."""
    slopes: dict[Node, Value] = {}

    def slope_of(x: Value) -> Value:
        return slopes[x] if isinstance(x, Node) else 0.0

    for node in in_order([quantity]):
        slopes[node] = _slope(node, rates, slope_of) if node.moves else 0.0
    return slope_of(quantity)


def _slope(node, rates, slope_of):
    """Return the derivative of a node, `slope_of` those of its arguments."""
    if node.op == "t":
        return 1.0
    if node.op == "y":
        return rates[node.args[0]]
    if node.op in ("side", "rint") or node.is_mask:
        return 0.0
    new = node.graph.node

    def times(a, b):
        return new("*", a, b)

    a, b = (*node.args, 0.0)[:2]
    match node.op:
        case "where" | "bend":
            mask, a, b = node.args
            return new("where", mask, slope_of(a), slope_of(b))
        case "+" | "-":
            return new(node.op, slope_of(a), slope_of(b))
        case "*":
            return new("+", times(slope_of(a), b), times(a, slope_of(b)))
        case "/":
            return new("/", new("-", slope_of(a), times(node, slope_of(b))), b)
        case "**":
            by_base = times(times(b, slope_of(a)), new("**", a, new("-", b, 1.0)))
            by_power = times(slope_of(b), times(node, new("log", a)))
            return new("+", by_base, by_power)
        case "sin":
            return times(slope_of(a), new("cos", a))
        case "cos":
            return times(slope_of(a), new("-", 0.0, new("sin", a)))
        case "exp":
            return times(slope_of(a), node)
        case "expm1":
            return times(slope_of(a), new("exp", a))
        case "tanh":
            return times(slope_of(a), new("-", 1.0, times(node, node)))
        case "log":
            return new("/", slope_of(a), a)
        case "log1p":
            return new("/", slope_of(a), new("+", 1.0, a))
        case "sqrt":
            return new("/", times(0.5, slope_of(a)), node)
        case "maximum":  # with 0
            return new("where", new(">", node, 0.0), slope_of(a), 0.0)
        case "arctan":
            return new("/", slope_of(a), new("+", 1.0, times(a, a)))
    raise node.graph.fault(f"the slope of np.{node.op} is not known")
