"""Nominal values, SI, by the paper's letters; it prints them before equation (1).

References
----------
E. Ya. Antonyuk, A. G. Zabuga, On the dynamic loading of machines with parallel
statically indeterminate kinematic chains (2012); equation numbers are the paper's.
"""

from __future__ import annotations

from types import SimpleNamespace

NOMINAL = SimpleNamespace(
    m=7800.0,  # kg, carriage
    I_s=2770.0,  # kg m2, carriage about the vertical
    dl_s=0.864,  # m, carriage between the rod hinges
    dh=1.5,  # m, carriage along the guides
    dL=0.0025,  # m, side clearance in the guides
    foot=0.1,  # m, width of the carriage's feet
    mu=0.05,
    l=2.45,  # m, rods
    k=9.4e7,  # N/m
    H=188000.0,  # N s/m, follows k rod by rod
    r=0.35,  # m, cranks
    I=130.0,  # kg m2, wheels 7, 8
    r3=0.546,  # m
    c3=6.9e6,  # N m/rad, shaft 9
    Hc3=13800.0,  # N m s/rad
    k3=3.44e9,  # N/m, tooth meshes
    Hk3=68800.0,  # N s/m
    r2=0.21,  # m, pinions 10, 11
    c2=8.6e6,  # N m/rad, shaft 12
    Hc2=17200.0,  # N m s/rad
    r1=0.21,  # m, gear 13
    h=0.28,  # m, rod hinges above the wheel axis
    F0=29400.0,  # N, rolling force
    x_roll=2.2,  # m, where it begins
    beta1=1e3,  # 1/m
    beta2=1e3,  # s/m
    beta3=1e6,  # 1/rad
    beta4=1e8,  # 1/rad
    beta5=1e5,  # s/rad
    c_s=1e8,  # N m/rad, contact with the guides
    H_s=2e5,  # N m s/rad
    g=9.81,  # m/s2
)
