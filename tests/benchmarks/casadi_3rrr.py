#!/usr/bin/env python3
"""The paper's move in CasADi with Ipopt/MUMPS: what a user would otherwise write. Limits at the LGR points.

Prints one JSON object: duration, iterations, seconds to build and to solve. Its fastest set-up here: the stage functions
mapped over the points, derivatives by CasADi, the program itself not expanded.
"""
import json
import sys
import time
import tomllib

import casadi as ca
import numpy as np


def radau(count):
    """LGR points and +1, and the differentiation matrix at the points."""
    legendre = np.polynomial.legendre
    series = np.zeros(count + 1)
    series[-2:] = 1.0
    nodes = np.sort(legendre.legroots(series).real)
    nodes[0] = -1.0
    for _ in range(3):
        nodes[1:] -= legendre.legval(nodes[1:], series) / legendre.legval(nodes[1:], legendre.legder(series))
    nodes = np.append(nodes, 1.0)
    gaps = nodes[:, None] - nodes[None, :] + np.eye(count + 1)
    weights = 1.0 / gaps.prod(axis=1)
    matrix = weights[None, :] / weights[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return nodes[:-1], matrix[:-1]


def model(m):
    """Accelerations, elastic displacement and joint rates of the flexible 3-RRR."""
    length, side = m["link_length_m"], m["platform_side_m"]
    mu = m["density_kg_per_m3"] * m["link_thickness_m"] * m["link_height_m"]
    stiffness = m["youngs_modulus_pa"] * m["link_height_m"] * m["link_thickness_m"] ** 3 / 12 * length / 3
    base = m["base_side_m"] * np.array([[0, 0], [1, 0], [0.5, 3**0.5 / 2]])
    corner = np.radians([210, -30, 90])
    sign = 1 if m["elbow"] == "plus" else -1
    q, v, torque = ca.SX.sym("q", 6), ca.SX.sym("v", 6), ca.SX.sym("torque", 3)
    kinetic = 0.5 * m["platform_mass_kg"] * (v[0] ** 2 + v[1] ** 2) + 0.5 * m["platform_inertia_kg_m2"] * v[2] ** 2
    angles, rows, right = [], [], []
    for i in range(3):
        platform = q[:2] + side / 3**0.5 * ca.vertcat(ca.cos(q[2] + corner[i]), ca.sin(q[2] + corner[i]))
        bend = q[3 + i] * length**2 / 3
        reach = platform - base[i]
        far, arm = ca.norm_2(reach), ca.sqrt(length**2 + bend**2)
        inner = ca.acos((arm**2 + far**2 - length**2) / (2 * arm * far))
        angle = ca.atan2(reach[1], reach[0]) + sign * inner - ca.atan2(bend, length)
        along, across = ca.vertcat(ca.cos(angle), ca.sin(angle)), ca.vertcat(-ca.sin(angle), ca.cos(angle))
        elbow = base[i] + length * along + bend * across
        rate = ca.jacobian(angle, q) @ v
        at_elbow, at_platform = ca.jacobian(elbow, q) @ v, ca.jacobian(platform, q) @ v
        curve, curve_rate = q[3 + i], v[3 + i]
        kinetic += 0.5 * m["motor_inertia_kg_m2"] * m["reducer_ratio"] ** 2 * rate**2
        kinetic += 0.5 * m["elbow_joint_mass_kg"] * ca.dot(at_elbow, at_elbow)
        kinetic += 0.5 * m["platform_joint_mass_kg"] * ca.dot(at_platform, at_platform)
        kinetic += 0.5 * mu * (
            length**3 / 3 * rate**2
            + 11 * length**4 / 60 * rate * curve_rate
            + 11 * length**5 / 420 * (curve_rate**2 + curve**2 * rate**2)
        )
        link = ca.dot(at_elbow, at_elbow) + ca.dot(at_elbow, at_platform) + ca.dot(at_platform, at_platform)
        kinetic += m["passive_link_mass_kg"] / 6 * link
        unit = (platform - elbow) / length
        rows.append(unit.T @ ca.jacobian(platform, q[:3]))
        right.append(ca.dot(unit, across) * bend)
        angles.append(angle)
    jacobian = ca.jacobian(ca.vertcat(*angles), q)
    mass = ca.hessian(kinetic, v)[0]
    bias = ca.jacobian(mass @ v, q) @ v - ca.gradient(kinetic, q) + ca.vertcat(0, 0, 0, stiffness * q[3:])
    acceleration = ca.solve(mass, jacobian.T @ torque - bias)
    displacement = ca.solve(ca.vertcat(*rows), ca.vertcat(*right))
    return q, v, torque, acceleration, displacement, jacobian @ v


def main():
    with open(sys.argv[1], "rb") as file:
        move = tomllib.load(file)
    machine, limits = move["machine"], move["limits"]
    intervals, points = move["mesh"]["intervals"], move["mesh"]["points"]
    started = time.perf_counter()
    q, v, torque, acceleration, displacement, joint_rate = model(machine)
    pose = [np.array([move["move"][end][key] for key in ("x_m", "y_m", "phi_rad")]) for end in ("from", "to")]
    scale = np.concatenate([np.full(3, 150.0), [0.03, 0.03, 0.1], np.full(3, 0.5), [1, 1, 3], np.full(3, 100.0)])
    shift = np.concatenate([np.zeros(3), pose[0], np.zeros(9)])
    u, z = ca.SX.sym("u", 3), ca.SX.sym("z", 15)
    physical = ca.vertcat(torque, q, v)
    rate_limit = limits["torque_rate_nm_per_s"]
    slope = ca.substitute(ca.vertcat(u * rate_limit, v, acceleration), physical, z * scale + shift) / scale
    speed = limits["motor_speed_rpm"] * 2 * np.pi / 60 / machine["reducer_ratio"]
    elastic = limits["elastic_displacement_m"]
    path = ca.vertcat(displacement[0] / elastic["x"], displacement[1] / elastic["y"], joint_rate / speed)
    path = ca.substitute(path, physical, z * scale + shift)
    stage, bounded = ca.Function("stage", [z, u], [slope]), ca.Function("bounded", [z], [path])

    nodes, matrix = radau(points)
    count = intervals * points
    states, controls, duration = ca.MX.sym("x", 15, count + 1), ca.MX.sym("u", 3, count), ca.MX.sym("t")
    unit = 0.05
    slopes = stage.map(count)(states[:, :-1], controls)
    defects = []
    for k in range(intervals):
        own = slice(k * points, (k + 1) * points)
        inside = states[:, k * points : (k + 1) * points + 1] @ ca.DM(matrix.T)
        defects.append(ca.vec(inside - duration * unit / intervals / 2 * slopes[:, own]))
    bounded_values = ca.vec(bounded.map(count + 1)(states))
    constraints = ca.vertcat(*defects, bounded_values)
    equal = 15 * count

    stress = limits["stress_pa"] * 2 / (machine["youngs_modulus_pa"] * machine["link_thickness_m"]) / 0.5
    upper = np.tile(
        np.concatenate([np.full(3, limits["torque_nm"] / 150), np.full(3, 10), np.full(3, stress), np.full(6, 50)]),
        (count + 1, 1),
    )
    lower = -upper
    lower[0] = upper[0] = 0
    lower[-1] = upper[-1] = np.concatenate([np.zeros(3), (pose[1] - pose[0]) / scale[3:6], np.zeros(9)])

    shares = np.append(np.concatenate([(k + (nodes + 1) / 2) / intervals for k in range(intervals)]), 1.0)
    start = np.zeros((count + 1, 15))
    step = (pose[1] - pose[0]) / scale[3:6]
    start[:, 3:6] = np.outer(10 * shares**3 - 15 * shares**4 + 6 * shares**5, step)
    rates = (pose[1] - pose[0]) / scale[9:12] / 0.06
    start[:, 9:12] = np.outer(30 * shares**2 - 60 * shares**3 + 30 * shares**4, rates)
    unknowns = ca.vertcat(ca.vec(states), ca.vec(controls), duration)
    options = {
        "print_time": False,
        "ipopt": {"print_level": 0, "sb": "yes", "tol": move["solver"]["tolerance"], "max_iter": 2000},
    }
    solver = ca.nlpsol("solver", "ipopt", {"x": unknowns, "f": duration, "g": constraints}, options)
    built = time.perf_counter()
    rows = 5 * (count + 1)
    result = solver(
        x0=np.concatenate([start.ravel(), np.zeros(3 * count), [1.2]]),
        lbx=np.concatenate([lower.ravel(), -np.ones(3 * count), [0.2]]),
        ubx=np.concatenate([upper.ravel(), np.ones(3 * count), [20.0]]),
        lbg=np.concatenate([np.zeros(equal), -np.ones(rows)]),
        ubg=np.concatenate([np.zeros(equal), np.ones(rows)]),
    )
    solved = time.perf_counter()
    print(
        json.dumps(
            {
                "peer": f"casadi {ca.__version__}",
                "solved": bool(solver.stats()["success"]),
                "duration_s": float(result["x"][-1]) * unit,
                "iterations": solver.stats()["iter_count"],
                "seconds": {"build": built - started, "solve": solved - built},
            }
        )
    )


main()
