"""The stand as a model: deviations of its parts in, responses of its trials out."""

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.stand import clearance, declarations, parameters
from tolstat.machines.stand.clearance import Contacts
from tolstat.machines.stand.declarations import END, RESPONSES, WINDOW, Settings
from tolstat.machines.stand.mechanism import mechanism_of
from tolstat.machines.stand.motion import Loads, Motion, Powers, State, motion
from tolstat.machines.stand.parameters import Parameters
from tolstat.machines.stand.views import (
    OFFERS,
    chart_of,
    loads,
    loops_at_90,
    self_stress,
)
from tolstat.model.contract import History, Model, Outcome, Spreads, sample_times
from tolstat.model.description import SHARE, Description, StudyNumber
from tolstat.model.mechanism import Mechanism
from tolstat.moving import Accuracy, Moment, Solution, System, integrate
from tolstat.status import Status

FRAMES = 240  # of an animation


class Stand(Model):
    """Drive of the carriage of a KhPT-75 cold pilger mill."""

    name = "stand"
    title = "KhPT-75 cold pilger mill: carriage driven by two parallel crank-rod chains"
    settings = Settings
    failures = declarations.FAILURES
    views = OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Settings) -> Description:
        return declarations.description_of(settings)

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        return parameters.faults(deviations, settings)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        p = parameters.build(deviations, settings)
        return outcome_of(simulated(p, settings), p, settings)

    def numbers(
        self, settings: Settings, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        numbers: list[StudyNumber] = []
        if settings.l <= settings.r + settings.h:  # cannot be mounted
            return ()
        for guides, stand in loops_at_90(settings).items():
            words = f"degree of static indeterminacy, guides {guides}"
            degree = len(self_stress(stand))
            numbers.append(StudyNumber(f"degree_{guides}", "1", degree, words, "count"))
        for name, dN in loads(stand).items():
            load = float(dN[stand.members.index("rod_1")])
            if load and name in spreads and not name.endswith("_2"):
                per, shown_per = ("rad", "mrad") if "angle" in name else ("m", "mm")
                words = "in rod 1, guides touched, crank at 90 deg"
                number = (f"load_{name}", f"N/{per}", load, words, f"kN/{shown_per}")
                numbers.append(StudyNumber(*number))
        return tuple(numbers)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        p = parameters.build(deviations[None, :], settings)
        marks = marks_of(settings)
        time = sample_times(float(marks[END]), step)
        solution = simulated(p, settings, time)
        moving = moved_over(time, solution.history[0], p, settings)
        window = (float(marks[WINDOW]), float(marks[END]))
        chart = chart_of(time, solution.history[0], moving, window, float(p.delta[0]))
        return History(chart, outcome_of(solution, p, settings))

    def mechanism(self, deviations: Array, settings: Settings) -> Mechanism:
        p = parameters.build(deviations[None, :], settings)
        time = np.linspace(0.0, float(marks_of(settings)[END]), FRAMES)
        states = simulated(p, settings, time).history[0]
        straight = states.copy()
        straight[:, State._fields.index("alpha")] = 0.0
        n = len(State._fields)
        moving, unyawed = (
            (State(*y.T[:n]), moved_over(time, y, p, settings))
            for y in (states, straight)
        )
        return mechanism_of(time, moving, unyawed, p, settings)


def simulated(
    p: Parameters, settings: Settings, samples: Array | None = None
) -> Solution:
    """Integrate trials over the whole run, with their states at the sample times.

    States are those of the equations, then `Contacts`, which are 0 without play.
    """
    # only a simulation needs the compiler, and only play its own equations
    from tolstat.machines.stand.compiled import SYSTEM

    start, table = start_of(p, settings), np.stack(p, axis=1)

    def solved(system: System, start: Array, those: Truths) -> Solution:
        marks = np.tile(marks_of(settings), (len(start), 1))
        accuracy = Accuracy(settings.rtol, settings.max_step)
        return integrate(
            system, start, table[those], marks, accuracy,
            watch_from=WINDOW, samples=samples,
        )  # fmt: skip

    loose = (p.half_c1 > 0) | (p.half_c2 > 0)
    rigid = solved(SYSTEM, start[~loose], ~loose)
    wider = (0, 0), (0, 0), (0, len(Contacts._fields))
    states, history = (np.pad(y, wider) for y in (rigid.states, rigid.history))
    # without the turns, which are watched only to end steps there
    above = np.pad(rigid.above[:, :1], ((0, 0), (0, 2)))
    rigid = rigid._replace(states=states, history=history, above=above)
    if not loose.any():
        return rigid
    from tolstat.machines.stand import contacts

    begun = np.hstack([start, np.stack(contacts_at_start(start, p), axis=1)])
    played = solved(contacts.SYSTEM, begun[loose], loose)
    n = rigid.greatest.shape[1]
    played = played._replace(
        greatest=played.greatest[:, :n],
        least=played.least[:, :n],
        above=played.above[:, :-1],
    )
    # in the order of the trials
    order = np.argsort(np.argsort(loose, kind="stable"))
    both = zip(rigid, played, strict=True)
    return Solution(*(np.concatenate(fields)[order] for fields in both))


def moved(t: Array, phase: Array, states: Array, p: Parameters) -> Motion:
    """Return the motion at float64[trial or moment, state], `Contacts` last."""
    n = len(State._fields)
    y, contacts = State(*states.T[:n]), Contacts(*states.T[n:])
    return motion(Moment(t, phase), y, p, clearance.joints_of(contacts, p))


def moved_over(time: Array, states: Array, p: Parameters, settings: Settings) -> Motion:
    """Return the motion of one trial at float64[moment], s, of its states there."""
    marks = marks_of(settings)
    phase = np.searchsorted(marks[1:-1], time, side="right").astype(float)
    return moved(time, phase, states, p)


def contacts_at_start(start: Array, p: Parameters) -> Contacts:
    """Return the contacts of trials at rest: those that start loaded touch."""
    still = np.zeros(len(start))
    result = motion(Moment(still, still), State(*start.T), p)
    play = clearance.play_of(result.rods, p)
    sides = clearance.excess_of(play)
    return clearance.met(Contacts(*[still] * 6), sides, play, False)


def outcome_of(solution: Solution, p: Parameters, settings: Settings) -> Outcome:
    """Return the responses in the order of `describe`."""
    with np.errstate(invalid="ignore"):
        responses = responses_of(solution, p, settings)
    table = np.stack([responses[r.name] for r in RESPONSES], axis=1)
    shares = table[:, [r.range == SHARE for r in RESPONSES]]
    too_much = ((shares < 0) | (shares > 1)).any(axis=1)
    done = solution.status == Status.DONE
    failed = {declarations.NO_SHARE: done & too_much}
    return Outcome(table, solution.status, solution.steps, failed)


def marks_of(settings: Settings) -> Array:
    """Return start, end of start-up, start and end of the window, s."""
    turn = 2 * np.pi / settings.crank_speed
    window = settings.start_up + settings.settle * turn
    return np.array([0.0, settings.start_up, window, window + settings.cycles * turn])


def start_of(p: Parameters, settings: Settings) -> Array:
    """Return float64[trial, state]: leftmost position, at rest, (10), (11)."""
    phi, x, sin_alpha = parameters.initial_position(p)
    still = np.zeros_like(phi)
    with np.errstate(invalid="ignore"):
        yaw = still if settings.variant == "equalized" else np.arcsin(sin_alpha)
    start = State(
        phi31=phi, phi32=phi, x=x, alpha=yaw,
        phi31_=still, phi32_=still, x_=still, alpha_=still,
    )  # fmt: skip
    return np.stack(start, axis=1)


def responses_of(
    solution: Solution, p: Parameters, settings: Settings
) -> dict[str, Array]:
    """Return the responses by name, SI, from a solution."""
    marks = marks_of(settings)

    def stored(mark: int) -> Array:
        t, phase = np.full(len(p.m), marks[mark]), np.full(len(p.m), float(mark))
        return moved(t, phase, solution.states[:, mark], p).stored

    run = Powers(*solution.quadratures[:, END].T)
    energy = Powers(*(solution.quadratures[:, END] - solution.quadratures[:, WINDOW]).T)
    greatest, least = Loads(*solution.greatest.T), Loads(*solution.least.T)
    lost = sum(energy[1:])
    residual = energy.drive - (stored(END) - stored(WINDOW)) - lost
    # a time that is summed step by step may exceed the window by some ulps
    shares = np.minimum(solution.above.T / (marks[END] - marks[WINDOW]), 1.0)
    contacts = Contacts(*solution.states[:, END, len(State._fields) :].T)
    return {
        "extra_loss": energy.guide / energy.drive,
        "extra_loss_run": run.guide / run.drive,
        **{f"{name}_energy": v for name, v in energy._asdict().items()},
        "energy_residual": residual / energy.drive,
        **Loads(*solution.peak.T)._asdict(),
        "rod_tension_1": np.maximum(greatest.rod_force_1, 0.0),
        "rod_tension_2": np.maximum(greatest.rod_force_2, 0.0),
        "rod_compression_1": np.maximum(-least.rod_force_1, 0.0),
        "rod_compression_2": np.maximum(-least.rod_force_2, 0.0),
        **dict(zip(("jam_share", "free_share_1", "free_share_2"), shares, strict=True)),
        **{name: v for name, v in contacts._asdict().items() if name[0] != "s"},
    }
