"""A scene as the text of its file, and whether two scenes are the same to the last
bit."""

import jax
import numpy as np

TEXT = """
format = "simbrake scene 1"
end_time = "5 s"

[brake]
pulley = { radius = "590 mm", inertia = "1200 kg*m^2" }
band = { radius = "623 mm", stiffness = "100 kN/m" }
linings = { count = 20, wrap = "270 deg", friction = 0.35 }

[duty]
slack_tension = { start = "2 kN", end = "24 kN", begin = 0, duration = "350 ms" }
load = { mass = "60 t", drum_radius = "40 cm", line_count = 8 }

[initial]
omega = "24 rad/s"
"""


def assert_same(a, b):
    (x, s) = jax.tree.flatten(a)
    (y, t) = jax.tree.flatten(b)
    assert s == t
    for one, other in zip(x, y, strict=True):
        assert np.shape(one) == np.shape(other)
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes()
