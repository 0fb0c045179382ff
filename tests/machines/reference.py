"""Reference cases of the stand: printed numbers of two independent implementations."""

from __future__ import annotations

D58 = {"contact_yaw": 5.8e-4}
CASES = {
    "A": ({}, {}),
    "B": ({"crank_difference": 1e-3}, D58),
    "C": ({"crank_difference": 3e-3}, D58),
    "D": ({"crank_difference": 1e-3}, {**D58, "variant": "equalized"}),
    "E": (
        {"crank_difference": 1e-3},
        {**D58, "variant": "equalized", "drive": "balanced"},
    ),
    "F": (
        {
            "rod_length_1": 8e-4, "rod_length_2": -3e-4,
            "crank_radius_1": 2e-4, "crank_radius_2": -4e-4,
        },
        {},
    ),
    "G": (
        {
            "rod_length_1": -5e-4, "rod_length_2": 9e-4,
            "crank_radius_1": -3e-4, "crank_radius_2": 3e-4,
            "runout_7": 6e-5, "runout_phase_7": 0.7,
            "runout_8": 4e-5, "runout_phase_8": 2.1,
            "runout_10": 3e-5, "runout_phase_10": 4.0,
            "runout_11": 5e-5, "runout_phase_11": 5.5,
            "tooth_position_2": 4e-5,
            "mesh_stiffness_1": 3.2 / 3.44 - 1, "mesh_stiffness_2": 3.7 / 3.44 - 1,
            "rod_stiffness_1": 9.0 / 9.4 - 1, "rod_stiffness_2": 9.8 / 9.4 - 1,
        },
        {},
    ),
    "H": (
        {
            "crank_difference": 1e-3, "rod_difference": 2e-4,
            "crank_angle_1": 4e-4, "crank_angle_2": -3e-4, "tooth_position_1": 3e-5,
            "shaft_9_stiffness": 0.1, "shaft_12_stiffness": -0.1,
            "wheel_inertia_1": 0.02, "wheel_inertia_2": -0.02, "carriage_mass": 0.03,
            "friction": 0.2, "rolling_force": 0.1, "mesh_stiffness_0": -0.05,
            "guide_clearance": -1.2e-3,
        },
        {"crank_speed": 6.0, "start_up": 0.8, "settle": 2, "cycles": 1},
    ),
}  # fmt: skip

_PRINT = """
extra_loss 1.05631e-08 0.0181406 0.115557 0 0 0.00267257 0.0162932 0.0184068
extra_loss_run 7.34509e-09 0.0121528 0.0807689 0 0 0.00195118 0.0117537 0.0166071
drive_energy 45233 46086.8 51237.6 45232.8 45231.5 45369.7 46017.2 26114.4
slide_energy 10747.5 10751 10774.9 10747.5 10747.5 10744.8 10751.5 6674.40
guide_energy 0.0004778 836.041 5920.88 0 0 121.254 749.77 480.681
roll_energy 34458.9 34458.6 34457.4 34458.9 34458.9 34467.5 34470.9 18939.8
spin_energy 0.255869 12.216 23.4181 0 0 8.96035 5.89383 9.10045
rod_force_1 103285 121500 194178 102601 102688 93726 120845 77832.5
rod_force_2 101922 86042.8 31116.6 102601 102688 112686 86722.3 70772.5
shaft_9_moment 1903.44 1834.53 1185.03 1991.54 26.7884 1881.5 2803.45 1231.51
shaft_12_moment 6280.64 6077.17 3761.39 6536.93 0 6214.08 6918.68 4297.30
mesh_force_0 69485.9 69581.4 70602.9 69482.7 69432.3 69382.3 69534.5 57380.2
mesh_force_1 39730.8 41046.8 59546.5 38535.9 34716.2 40030 43678.6 38953.5
mesh_force_2 29907.8 28938.9 17911.4 31128.2 34716.2 29590.9 32946.1 20463.3
yaw 3.19453e-05 0.000720137 0.00131826 0 0 0.00172971 0.0018006 0.00105628
drive_moment 14620.2 14655.8 14885.7 14622.4 14580.8 14604.1 14635.2 12089.1
damping_energy 26.2973 28.5639 52.1666 26.3447 25.0400 27.1122 27.6687 10.3413
contact_energy 2.43e-8 0.416583 8.85679 0 0 0.062272 0.108468 0.118107
rod_compression_1 70236.0 88230.9 161694 69442.8 69463.0 70961.9 71125.6 74316.7
rod_tension_2 101922 86043.0 24854.7 102601 102688 112686 86722.4 70772.5
jam_share 0 0.7251 0.9099 0 0 0.2552 0.4635 0.4520
"""

TABLE = {words[0]: words[1:] for words in map(str.split, _PRINT.strip().splitlines())}

# cases of other constants, of all contributors, and of play in the joints
MORE = {
    "K": (
        {"crank_difference": 1.2e-3, "rod_length_1": 3e-4},
        {
            "m": 9000.0, "I_s": 3100.0, "dl_s": 0.9, "dh": 1.6, "dL": 0.0012,
            "foot": 0.12, "mu": 0.06, "l": 2.6, "k": 8e7, "H": 1.5e5, "r": 0.4,
            "I": 150.0, "r3": 0.56, "r2": 0.2, "r1": 0.22, "c3": 6e6, "Hc3": 12000.0,
            "k3": 3e9, "Hk3": 6e4, "c2": 8e6, "Hc2": 16000.0, "h": 0.25, "F0": 35000.0,
            "x_roll": 2.35, "beta1": 800.0, "beta2": 1200.0, "beta3": 2e6,
            "beta4": 5e7, "beta5": 8e4, "c_s": 8e7, "H_s": 1.5e5, "g": 9.8,
            "crank_speed": 6.5, "start_up": 0.9,
        },
    ),
    "J": (
        {
            "crank_difference": 1e-3, "guide_clearance": -1.2e-3,
            "hinge_height_1": 2e-3, "hinge_height_2": -1e-3, "hinge_arm_1": 2e-3,
            "hinge_arm_2": -1e-3, "guide_length": 5e-3, "carriage_inertia": 0.05,
            "rod_damping_1": 0.2, "rod_damping_2": -0.2, "mesh_damping": 0.3,
            "shaft_9_damping": -0.3, "shaft_12_damping": 0.3, "guide_damping": 0.5,
            "guide_stiffness": -0.3,
        },
        {},
    ),
    "L1": ({"joint_clearance_1": 2e-4, "joint_clearance_2": 2e-4}, {}),
    "L2": (
        {
            "crank_difference": 1e-3,
            "joint_clearance_1": 3e-4, "joint_clearance_2": 1e-4,
        },
        D58,
    ),
    "L3": (
        {
            "crank_difference": 1e-3,
            "joint_clearance_1": 2e-4, "joint_clearance_2": 3e-4,
        },
        {"variant": "equalized"},
    ),
}  # fmt: skip
_MORE = """
extra_loss .019046249 .012510059 9.744628e-9 .012013484 0
drive_energy 63164.935 45825.955 45252.900 45818.885 45259.456
damping_energy 36.521978 28.941255 37.065813 38.746716 41.473677
rod_force_1 114686.83 123848.39 103042.86 117693.16 102387.94
rod_force_2 100579.0 83896.07 101954.31 89207.44 102387.94
shaft_9_moment 1884.5762 2036.7800 1910.3837 1941.1647 1991.6817
mesh_force_1 50958.985 42294.666 39635.031 39502.960 38538.656
yaw 9.954419e-4 1.0928238e-3 3.390406e-5 6.902286e-4 0
contacts_1 0 0 4 4 4
contacts_2 0 0 4 4 4
approach_1 0 0 .02668695 .03131990 .06441661
approach_2 0 0 .02682406 .01967032 .06441661
free_share_1 0 0 .03486157 .04501251 .03718797
free_share_2 0 0 .03094134 .01850462 .03718797
"""
MORE_TABLE = {n: words for n, *words in map(str.split, _MORE.strip().splitlines())}

# crank_difference, mm: extra_loss_run, per cent, with contact_yaw 5.8e-4
FIG4 = {
    0.25: 0.000, 0.5: 0.003, 0.75: 0.475, 1: 1.215,
    1.5: 2.89, 2: 4.65, 2.5: 6.39, 3: 8.08,
}  # fmt: skip
