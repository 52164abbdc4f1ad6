#!/usr/bin/env python3
"""The ten problems in YAPSS and MAPTOR on equal meshes, beside what `stillpoint bench --json` gave.

    peers.py FIXED.json AUTOMATIC.json INTERVALS POINTS [PROBLEM ...]

Every problem is written once, over a module of functions, and given to both with the ends as only guess, as to Stillpoint. Seconds are
those of building and solving in a running process, without imports.
"""
import io
import json
import math
import sys
import time
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Callable

import casadi
import maptor
import numpy as np
import yapss
import yapss.math

FREE = (-math.inf, math.inf)
TOLERANCE = 1e-9
ITERATIONS = 1000


@dataclass
class Benchmark:
    """States (initial, final or None, bounds), controls (bounds), f(x, u, m), duration (fixed, or bounds), cost."""

    states: list
    controls: list
    dynamics: Callable
    duration: tuple
    guess: tuple  # duration, last states, controls
    running: Callable | None = None
    final: Callable = field(default=lambda x, t: t)


def robot_arm(x, u, m):
    inertia = ((5 - x[0]) ** 3 + x[0] ** 3) / 3
    return [x[1], u[0] / 5, x[3], u[1] / (inertia * m.sin(x[4]) ** 2), x[5], u[2] / inertia]


def two_link_arm(x, u, m):
    sin, cos = m.sin(x[2]), m.cos(x[2])
    by = 1 / (31 / 36 + 9 / 4 * sin**2)
    first = sin * (9 / 4 * cos * x[0] ** 2 + 2 * x[1] ** 2) + 4 / 3 * (u[0] - u[1]) - 3 / 2 * cos * u[1]
    second = -(sin * (7 / 2 * x[0] ** 2 + 9 / 4 * cos * x[1] ** 2) - 7 / 3 * u[1] + 3 / 2 * cos * (u[0] - u[1]))
    return [first * by, second * by, x[1] - x[0], x[0]]


def goddard(x, u, m):
    drag = 310 * x[1] ** 2 * m.exp(-500 * (x[0] - 1))
    return [x[1], (u[0] - drag) / x[2] - 1 / x[0] ** 2, -2 * u[0]]


QUARTER = math.pi / 4
BENCHMARKS = {
    "bryson-denham": Benchmark(
        [(0, 0, (-math.inf, 1 / 9)), (1, -1, FREE)],
        [FREE],
        lambda x, u, m: [x[1], u[0]],
        (1, 1),
        (1, [0, -1], [0]),
        running=lambda x, u: u[0] ** 2 / 2,
    ),
    "hypersensitive": Benchmark(
        [(1, 1.5, FREE)],
        [FREE],
        lambda x, u, m: [u[0] - x[0] ** 3],
        (1e4, 1e4),
        (1e4, [1.5], [0]),
        running=lambda x, u: (x[0] ** 2 + u[0] ** 2) / 2,
    ),
    "brachistochrone": Benchmark(
        [(0, 2, FREE), (0, 2, FREE), (0, None, FREE)],
        [(-4, 4)],
        lambda x, u, m: [x[2] * m.sin(u[0]), x[2] * m.cos(u[0]), 9.8 * m.cos(u[0])],
        (0.1, 10),
        (1, [2, 2, 5], [0]),
    ),
    "triple-integrator": Benchmark(
        [(0, 1, FREE), (0, 0, FREE), (0, 0, FREE)],
        [(-1, 1)],
        lambda x, u, m: [x[1], x[2], u[0]],
        (0.1, 100),
        (5, [1, 0, 0], [0]),
    ),
    "floating-oscillator": Benchmark(
        [(0, 1, FREE), (0, 1, FREE), (0, 0, FREE), (0, 0, FREE)],
        [(-1, 1)],
        lambda x, u, m: [x[2], x[3], u[0] - (x[0] - x[1]), x[0] - x[1]],
        (0.1, 100),
        (5, [1, 1, 0, 0], [0]),
    ),
    "robot-arm": Benchmark(
        [
            (4.5, 4.5, (0, 5)),
            (0, 0, FREE),
            (0, 2 * math.pi / 3, (-math.pi, math.pi)),
            (0, 0, FREE),
            (QUARTER, QUARTER, (0, math.pi)),
            (0, 0, FREE),
        ],
        [(-1, 1)] * 3,
        robot_arm,
        (0.1, 100),
        (10, [4.5, 0, 2 * math.pi / 3, 0, QUARTER, 0], [0, 0, 0]),
    ),
    "two-link-arm": Benchmark(
        [(0, 0, FREE), (0, 0, FREE), (0.5, 0.5, FREE), (0, 0.522, FREE)],
        [(-1, 1)] * 2,
        two_link_arm,
        (0.1, 100),
        (3, [0, 0, 0.5, 0.522], [0, 0]),
    ),
    "rayleigh": Benchmark(
        [(-5, None, FREE), (-5, None, FREE)],
        [FREE],
        lambda x, u, m: [x[1], -x[0] + x[1] * (1.4 - 0.14 * x[1] ** 2) + 4 * u[0]],
        (2.5, 2.5),
        (2.5, [0, 0], [0]),
        running=lambda x, u: u[0] ** 2 + x[0] ** 2,
    ),
    "goddard": Benchmark(
        [(1, None, (1, math.inf)), (0, None, (0, math.inf)), (1, 0.6, (0.6, 1))],
        [(0, 3.5)],
        goddard,
        (0.01, 10),
        (0.2, [1.01, 0, 0.6], [1.75]),
        final=lambda x, t: -x[0],
    ),
    "van-der-pol": Benchmark(
        [(0, None, (-0.25, math.inf)), (1, None, FREE)],
        [(-1, 1)],
        lambda x, u, m: [(1 - x[1] ** 2) * x[0] - x[1] + u[0], x[0]],
        (10, 10),
        (10, [0, 0], [0]),
        running=lambda x, u: x[0] ** 2 + x[1] ** 2 + u[0] ** 2,
    ),
}


def by_yapss(benchmark, intervals, points):
    """The objective by YAPSS with LGR points."""
    n = len(benchmark.states)
    integrals = 1 if benchmark.running else 0
    problem = yapss.Problem(name="p", nx=[n], nu=[len(benchmark.controls)], nq=[integrals])

    def objective(arg):
        phase = arg.phase[0]
        arg.objective = phase.integral[0] if benchmark.running else benchmark.final(phase.final_state, phase.final_time)

    def continuous(arg):
        phase = arg.phase[0]
        phase.dynamics[:] = benchmark.dynamics(phase.state, phase.control, yapss.math)
        if benchmark.running:
            phase.integrand[0] = benchmark.running(phase.state, phase.control)

    problem.functions.objective, problem.functions.continuous = objective, continuous
    bounds, guess = problem.bounds.phase[0], problem.guess.phase[0]
    bounds.initial_time.lower = bounds.initial_time.upper = 0
    bounds.final_time.lower, bounds.final_time.upper = benchmark.duration
    for i, (initial, final, (lower, upper)) in enumerate(benchmark.states):
        bounds.initial_state.lower[i] = bounds.initial_state.upper[i] = initial
        if final is not None:
            bounds.final_state.lower[i] = bounds.final_state.upper[i] = final
        bounds.state.lower[i], bounds.state.upper[i] = lower, upper
    for i, (lower, upper) in enumerate(benchmark.controls):
        bounds.control.lower[i], bounds.control.upper[i] = lower, upper
    duration, last, controls = benchmark.guess
    guess.time = [0, duration]
    guess.state = [[state[0], end] for state, end in zip(benchmark.states, last)]
    guess.control = [[u, u] for u in controls]
    mesh = problem.mesh.phase[0]
    mesh.collocation_points, mesh.fraction = intervals * [points], intervals * [1 / intervals]
    problem.spectral_method = "lgr"
    problem.derivatives.method, problem.derivatives.order = "auto", "second"
    problem.ipopt_options.print_level = 0
    problem.ipopt_options.sb = "yes"
    problem.ipopt_options.tol, problem.ipopt_options.max_iter = TOLERANCE, ITERATIONS
    solution = problem.solve()
    return float(solution.objective), solution.nlp_info.ipopt_status in (0, 1)


def by_maptor(benchmark, intervals, points):
    """The objective by MAPTOR on a fixed mesh."""
    problem = maptor.Problem("p")
    phase = problem.set_phase(1)
    lower, upper = benchmark.duration
    t = phase.time(initial=0.0, final=lower if lower == upper else benchmark.duration)
    bounded = lambda limits: tuple(None if math.isinf(v) else v for v in limits)
    boundary = lambda limits: None if limits == FREE else bounded(limits)
    x = [
        phase.state(f"x{i}", initial=initial, final=final, boundary=boundary(limits))
        for i, (initial, final, limits) in enumerate(benchmark.states)
    ]
    u = [phase.control(f"u{i}", boundary=boundary(limits)) for i, limits in enumerate(benchmark.controls)]
    phase.dynamics(dict(zip(x, benchmark.dynamics(x, u, casadi))))
    if benchmark.running:
        problem.minimize(phase.add_integral(benchmark.running(x, u)))
    else:
        problem.minimize(benchmark.final([state.final for state in x], t.final))
    edges = np.linspace(-1, 1, intervals + 1)
    phase.mesh(intervals * [points], edges)
    duration, last, controls = benchmark.guess
    first = np.array([state[0] for state in benchmark.states])
    shares = [np.linspace(k / intervals, (k + 1) / intervals, points + 1) for k in range(intervals)]
    states = [first[:, None] + np.outer(np.array(last) - first, s) for s in shares]
    held = [np.outer(controls, np.ones(points)) for _ in shares]
    phase.guess(states=states, controls=held, initial_time=0.0, terminal_time=duration)
    options = {"ipopt.tol": TOLERANCE, "ipopt.max_iter": ITERATIONS, "ipopt.print_level": 0, "print_time": 0}
    solution = maptor.solve_fixed_mesh(problem, nlp_options=options, show_summary=False)
    return float(solution.status["objective"]), bool(solution.status["success"])


def measured(solve, benchmark, intervals, points):
    """Objective (or None) and seconds; what the peer prints is left out, what it refuses is a failure."""
    started = time.perf_counter()
    try:
        with redirect_stdout(io.StringIO()):
            value, solved = solve(benchmark, intervals, points)
    except Exception as error:
        print(f"{solve.__name__}: {type(error).__name__}: {error}", file=sys.stderr)
        value, solved = None, False
    return (value if solved else None), time.perf_counter() - started


def main():
    fixed, automatic = ({row["name"]: row for row in json.load(open(path))["benchmarks"]} for path in sys.argv[1:3])
    intervals, points = int(sys.argv[3]), int(sys.argv[4])
    names = sys.argv[5:] or list(BENCHMARKS)
    print(f"Errors of the objective and seconds; all on {intervals} intervals of {points} points, then Stillpoint by itself\n")
    print(f"{'problem':<20}{'stillpoint':>17}{'YAPSS 0.2.3':>17}{'MAPTOR 0.2.1':>17}{'stillpoint bench':>19}{'points':>8}")
    for name in names:
        own = fixed[name]
        cells = [(own["error"], own["seconds"])]
        for solve in (by_yapss, by_maptor):
            value, seconds = measured(solve, BENCHMARKS[name], intervals, points)
            cells.append((None if value is None else abs(value / own["answer"] - 1), seconds))
        best = automatic[name]
        line = "".join(f"{'failed' if e is None else format(e, '.1e'):>10}{s:>7.2f}" for e, s in cells)
        print(f"{name:<20}{line}{best['error']:>12.1e}{best['seconds']:>7.2f}{best['points']:>8}", flush=True)


main()
