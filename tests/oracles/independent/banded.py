"""Brakes under a band as a whole: rigid or elastic, on the pulley or on a bandage that
rides on it."""

from typing import NamedTuple

import numpy as np
from oracles.independent.base import (
    BACK,
    ELASTIC,
    HELD,
    OPEN,
    ROUNDING,
    SLIP,
    TAKE_UP,
    Brake,
    Pair,
    law_of,
    names_of_change,
    names_with_a_bandage,
)
from scenes import lining_ratio

SLIDES = (SLIP, BACK)


class Now(NamedTuple):
    """Forces, accelerations and slip at one instant."""

    torque: float  # of the band on what carries it (N·m)
    alpha: float  # of the pulley (rad/s²)
    alpha_b: float  # of what carries the band
    drive: float  # torque from the pulley to the bandage (N·m)
    capacity: float  # up to which the bandage sticks to the rim (N·m)
    lead: float  # R_b ω_b − ẋ_0 (m/s), of the sign of the slip speed
    band_speed: float  # ẋ (m/s)
    lever_power: float
    pairs: list[Pair]
    # load of each lining on the rim, of one off the rim what it lacks to touch (N)
    margin: np.ndarray


class Banded(Brake):
    """`J ω̇ = M_load − Λ`, `J_b ω̇_b = Λ − R_b (T_n − T_0)`, `T_n = C x` or what
    friction gives; no bandage: `Λ` all.

    On alike rims torques, inertia of the bandage, powers and energies are sums over the
    rims, the rest is of one.
    """

    def __init__(self, p):
        self.C = p["C"]
        self.bandage = p["bandage"]
        self.rims = p.get("rims", 1)
        own = [] if self.bandage is None else [max(abs(p["omega"]), 1.0)]
        own += [] if self.C is None else [p["lever"].largest() / self.C]
        super().__init__(p, 1 if self.bandage is None else 2, own)
        self.z = np.tan(p["beta"] / 2)
        self.sine = np.sin(p["beta"] / 2)
        self.inner = 0
        self.R_b = p["R_b"]
        self.sense = -1 if p["omega"] < 0 else 1
        self.left = None
        self.off = np.zeros(self.n, bool)  # linings that have lifted off the rim
        if self.bandage is not None:
            self.y[self.OWN.start] = p["omega"]
            self.inner_law = law_of(self.bandage["law"], p.get("fade"))
        if self.C is not None:
            self.y[self.OWN.stop - 1] = p["x"]

    def leave(self, t, y):
        self.left = self.limits_passed(t, y)

    def label(self):
        return (self.mode,) if self.bandage is None else (self.mode, self.inner)

    def carrier(self, y):
        """Speed of what carries the band (rad/s)."""
        stuck = self.bandage is None or self.inner == 0
        return float(y[1]) if stuck else float(y[self.OWN.start])

    def bandage_speeds(self, y):
        return 0.0 if self.bandage is None else self.carrier(y)

    def stretch(self, y):
        return 0.0 if self.C is None else float(y[self.OWN.stop - 1])

    # --- tensions --------------------------------------------------------------------

    def static_ratios(self, y):
        return lining_ratio(
            self.law.static(self.lining_temperatures(y)), self.p["beta"]
        )

    def mobilised(self, T_0, T_n, mu):
        """`T_0…T_n`: one lining after the other comes to its limit, from the slack
        end."""
        if T_n >= T_0:
            return np.minimum(T_0 * np.concatenate([[1.0], np.cumprod(mu)]), T_n)
        return np.minimum(
            T_n * np.concatenate([np.cumprod(mu[::-1])[::-1], [1.0]]), T_0
        )

    def sliding(self, t, y, back):
        """`T_0…T_n` while all linings slide; slopes of `T_n` by each coefficient; `v`;
        and `f` by `v`."""
        # the law sees the speed of what carries the band, which can turn while the band
        # still slides the other way
        v = np.full(self.n, self.sense * self.carrier(y) * self.R_b)
        sign = -1.0 if back else 1.0
        fz = sign * self.law.kinetic(v, self.lining_temperatures(y)) * self.z
        along = self.lever(t) * np.concatenate([[1.0], np.cumprod((1 + fz) / (1 - fz))])
        return along, along[-1] * sign * 2 * self.z / (1 - fz**2), v, sign

    def rim_friction(self, y, along, slides):
        """Largest forces (N) between linings and rim."""
        T = self.lining_temperatures(y)
        rim = self.bandage
        if slides == 0:
            f = self.inner_law.static(T)
        else:
            v = np.full(self.n, slides * (y[1] - y[self.OWN.start]) * self.p["R"])
            f = self.inner_law.kinetic(v, T)
        return f * self.rim_load(y, along) + 0 * rim["preload"]

    def rim_load(self, y, along):
        return np.where(self.off, 0.0, self.rim_balance(y, along))

    def rim_balance(self, y, along):
        """Load of the band and preload less the centrifugal force (N)."""
        rim = self.bandage
        omega_b = 0.0 if self.mode == HELD else self.carrier(y)
        thrust = rim["mass"] * rim["mass_radius"] * omega_b**2 if "mass" in rim else 0.0
        return (along[1:] + along[:-1]) * self.sine + rim["preload"] - thrust

    def rim_torque(self, y, along, slides):
        return (
            self.rims * self.p["R"] * float(np.sum(self.rim_friction(y, along, slides)))
        )

    def holding(self, t, y, slides):
        """`T_n` with `R_b (T_n − T_0) = ± M_int(T_n)`: the root on the straight piece
        on which it lies."""
        T_0 = self.lever(t)
        mu = self.static_ratios(y)
        up = T_0 * np.cumprod(mu)
        down = T_0 / np.cumprod(mu[::-1])
        at = np.concatenate([down[::-1], [T_0], up])

        def excess(T_n):
            drive = slides * self.rim_torque(y, self.mobilised(T_0, T_n, mu), slides)
            return self.rims * self.R_b * (T_n - T_0) - drive

        if T_0 <= 0:  # a lever that only begins to pull
            return 0.0
        values = np.array([excess(T_n) for T_n in at])
        k = int(np.clip(np.searchsorted(values, 0.0), 1, len(at) - 1))
        slope = (values[k] - values[k - 1]) / (at[k] - at[k - 1])
        return float(at[k] - values[k] / slope)

    # --- all of it at one instant ----------------------------------------------------

    def now(self, t, y):
        mode = self.mode
        T_0 = self.lever(t)
        omega = float(y[1])
        omega_b = self.carrier(y)
        M = self.driving(t, omega)
        stuck = self.bandage is None or self.inner == 0
        slopes = None
        if mode in SLIDES:
            along, *slopes = self.sliding(t, y, mode == BACK)
        else:
            T_n = 0.0
            if mode in (ELASTIC, TAKE_UP):
                T_n = self.C * self.stretch(y)
            elif mode == HELD:
                T_n = (
                    T_0 + self.driving(t, 0.0) / (self.rims * self.R_b)
                    if stuck
                    else self.holding(t, y, self.inner)
                )
            T_0 = {OPEN: 0.0, TAKE_UP: T_n}.get(mode, T_0)
            along = (
                self.mobilised(T_0, T_n, self.static_ratios(y))
                if T_0 > 0 or T_n > 0
                else np.zeros(self.n + 1)
            )
            if mode == TAKE_UP:
                along = np.full(self.n + 1, T_n)
        torque = self.rims * self.R_b * (along[-1] - T_0)
        J = self.J
        J_b = 0.0 if self.bandage is None else self.rims * self.bandage["J"]
        rim = None
        F = np.zeros(self.n)
        capacity = np.inf
        if self.bandage is not None:
            F = self.rim_friction(y, along, self.inner)
            capacity = self.rims * self.p["R"] * float(np.sum(F))
        if stuck:
            alpha = alpha_b = 0.0 if mode == HELD else (M - torque) / (J + J_b)
            drive = M - J * alpha
        else:
            drive = self.inner * capacity
            alpha = (M - drive) / J
            alpha_b = 0.0 if mode == HELD else (drive - torque) / J_b
        if self.bandage is not None:
            slip = 0.0 if stuck else self.p["R"] * (omega - omega_b)
            rim = Pair(self.rims * F * abs(slip), self.rim_load(y, along), slip)
        lead, slip_speed, band_speed = self._slip(
            t, y, omega_b, alpha_b, along, slopes, rim
        )
        power = self.rims * (along[1:] - along[:-1]) * slip_speed
        normal = (along[1:] + along[:-1]) * self.sine
        outer = Pair(power, normal, slip_speed)
        pairs = [outer] if rim is None else [outer, rim]
        margin = np.ones(self.n)
        if self.bandage is not None and "mass" in self.bandage and mode != HELD:
            margin = np.where(self.off, -1, 1) * self.rim_balance(y, along)
        lever_power = self.rims * T_0 * band_speed
        return Now(
            torque,
            alpha,
            alpha_b,
            drive,
            capacity,
            lead,
            band_speed,
            lever_power,
            pairs,
            margin,
        )

    def _slip(
        self,
        t,
        y,
        omega_b,
        alpha_b,
        along,
        slopes,
        rim,
    ):
        """`R_b ω_b − ẋ_0`, the slip speed, and the speed of the band."""
        speed = self.R_b * omega_b
        if self.mode not in SLIDES:
            return 0.0, 0.0, (speed if self.mode in (ELASTIC, TAKE_UP) else 0.0)
        if self.C is None:
            return speed, speed, 0.0
        by_f, v, sign = slopes
        T = self.lining_temperatures(y)
        growth = (
            self.lever.rate(t) * along[-1] / self.lever(t)
            if self.lever(t) > 0
            else self._first_ratio(y, sign)
        )
        growth += (
            float(np.sum(by_f * self.law.by_speed(v, T)))
            * self.sense
            * self.R_b
            * alpha_b
        )
        gamma = 0.0
        if self.heat is not None:
            still = Pair(np.zeros(self.n), np.zeros(self.n), 0.0)
            df = by_f * self.law.by_temperature(v, T)
            drift = self.warming(
                y,
                float(y[1]),
                self.friction_heat([still] if rim is None else [still, rim]),
            )
            growth += float(np.sum(df * drift[1:-1]))
            one = Pair(self.rims * (along[1:] - along[:-1]), still.normal, 1.0)
            each = (
                self.friction_heat([one] if rim is None else [one, still])
                / self.heat.capacity
            )
            gamma = float(np.sum(df * each[1:-1])) / self.C
        lead = speed - growth / self.C
        slip = lead / (1 + gamma)
        return lead, slip, speed - slip

    def _first_ratio(self, y, sign):
        """`Ṫ_0 Π^{±1}` of a lever that pulls from nothing."""
        v = np.full(self.n, self.sense * self.carrier(y) * self.R_b)
        f = sign * self.law.kinetic(v, self.lining_temperatures(y))
        ratios = lining_ratio(f, self.p["beta"])
        return self.lever.rate(self.begin) * float(np.prod(ratios))

    def rates(self, t, y):
        now = self.now(t, y)
        own = [] if self.bandage is None else [now.alpha_b]
        own += [] if self.C is None else [now.band_speed]
        rests = self.mode == HELD and self.inner == 0
        return self.assembled(
            t,
            y,
            now.alpha,
            own,
            now.pairs,
            lever_power=now.lever_power,
            omega=0.0 if rests else None,
        )

    def bounds(self, t, y):
        """Of a band at rest: least torque and what drives it there, largest torque and
        what drives it there (N·m)."""
        T_0 = self.lever(t)
        mu = self.static_ratios(y)
        M = self.driving(t, 0.0)
        low = T_0 / float(np.prod(mu))
        high = T_0 * float(np.prod(mu))
        drives = [M, M]
        if self.bandage is not None and self.inner:
            drives = [
                self.inner
                * self.rim_torque(y, self.mobilised(T_0, T_n, mu), self.inner)
                for T_n in (low, high)
            ]
        arm = self.rims * self.R_b
        return arm * (low - T_0), drives[0], arm * (high - T_0), drives[1]

    def guards(self, t, y):
        now = self.now(t, y)
        found = {}
        T_0 = self.lever(t)
        if self.mode == HELD:
            low, least, high, most = self.bounds(t, y)
            found |= {
                "above": (high - most) / self.torque,
                "below": (least - low) / self.torque,
            }
        elif self.mode != OPEN:
            found["motion"] = self.sense * self.carrier(y) / self.speed
        if self.mode in SLIDES and self.C is not None:
            found["stick"] = (
                (1 if self.mode == SLIP else -1) * now.lead / (self.R_b * self.speed)
            )
        if self.mode in (ELASTIC, TAKE_UP):
            tension = self.C * self.stretch(y)
            mu = self.static_ratios(y)
            if self.mode == TAKE_UP:
                found["upper"] = (T_0 - tension) / self.force
            else:
                ahead = T_0 * np.cumprod(mu)
                behind = tension * np.cumprod(mu[::-1])[::-1]
                found |= {
                    "upper": (ahead[-1] - tension) / self.force,
                    "lower": (behind[0] - T_0) / self.force,
                }
                if self.bandage is None:
                    found |= {
                        f"limit {i + 1}": (ahead[i] - tension) / self.force
                        for i in range(self.n - 1)
                    }
                    found |= {
                        f"limit -{i + 1}": (behind[i] - T_0) / self.force
                        for i in range(1, self.n)
                    }
        if self.bandage is not None:
            if "mass" in self.bandage and self.mode != HELD:
                found |= {
                    f"lift {i}": now.margin[i] / self.force for i in range(self.n)
                }
            if self.inner == 0:
                found["grip"] = (now.capacity - abs(now.drive)) / self.torque
            else:
                found["meet"] = (
                    self.inner * (float(y[1]) - float(y[self.OWN.start])) / self.speed
                )
        return found

    # --- changes of mode -------------------------------------------------------------

    def change(self, t, y, fired):
        passed = [name for name in fired if name.startswith("limit")]
        for name in passed:
            self.note(t, "lining_limit", abs(int(name.split()[1])))
        if fired and len(passed) == len(fired):
            return y
        lifted = [int(name.split()[1]) for name in fired if name.startswith("lift")]
        self._lift(t, lifted)
        if fired and len(passed) + len(lifted) == len(fired):
            return y
        y = y.copy()
        old = self.mode
        old_inner = self.inner
        old_limits = (
            self.limits_passed(t, y) if fired or self.left is None else self.left
        )
        if self.bandage is not None and "grip" in fired:
            self.inner = 1 if self.now(t, y).drive > 0 else -1
        if "motion" in fired:
            if self.bandage is not None:
                y[self.OWN.start] = 0.0
            if self.bandage is None or self.inner == 0:
                y[1] = 0.0
        if "meet" in fired:
            y[1] = y[self.OWN.start] = y[self.OWN.start] if self.mode == HELD else y[1]
            self.inner = 0
        for _ in range(4):
            self._settle_band(t, y, old, fired)
            if self.bandage is None:
                break
            if self.mode == HELD:
                self._lift(t, np.flatnonzero(self.off))
            else:
                jumped = np.flatnonzero(self.now(t, y).margin < -ROUNDING * self.force)
                self._lift(t, [i for i in jumped if i not in lifted])
            if self.inner:
                break
            now = self.now(t, self._jump(t, y, old))
            if abs(now.drive) <= now.capacity + ROUNDING * self.torque:
                break
            self.inner = 1 if now.drive > 0 else -1
        if self.bandage is not None and self.inner == 0:
            y[self.OWN.start] = y[1]
        y = self._jump(t, y, old)
        # a stretched band may pull it the other way
        if self.mode == ELASTIC and self.carrier(y) == 0:
            self.sense = int(np.sign(self.now(t, y).alpha_b)) or self.sense
        self._log(t, y, old, old_inner, old_limits)
        self.first = False
        leaves = self._leaves(t, y) if self.clipped else ""
        return self.change(t, y, [leaves]) if leaves else y

    def _lift(self, t, linings):
        """Linings leave the rim, or touch it again."""
        for i in linings:
            self.off[i] = not self.off[i]
            self.note(
                t, "lining_lift_off" if self.off[i] else "lining_touchdown", int(i) + 1
            )

    def _settle_band(self, t, y, old, fired):
        omega_b = self.carrier(y)
        if not self.pulls:
            self.mode = OPEN
            self.sense = self.sense if omega_b == 0 else int(np.sign(omega_b))
            return
        direction = int(np.sign(omega_b))
        if omega_b == 0:
            low, least, high, most = self.bounds(t, y)
            spare = ROUNDING * self.torque
            direction = 1 if most > high + spare else -1 if least < low - spare else 0
            if old == HELD and ("above" in fired or "below" in fired):
                direction = 1 if "above" in fired else -1
            if direction == 0:
                self.mode = HELD
                return
        self.sense = direction
        self.mode = (
            (SLIP if direction > 0 else BACK)
            if self.C is None
            else self._taut(t, y, old, fired, direction)
        )

    def _taut(self, t, y, old, fired, direction):
        """Mode of an elastic band on what moves, or starts to."""
        T_0 = self.lever(t)
        pull = self.lever.rate(t)
        omega_b = self.carrier(y)
        tension = self.C * self.stretch(y)
        rounding = ROUNDING * self.force
        slack = old in (OPEN, TAKE_UP)
        if slack and omega_b > 0 and not (old == TAKE_UP and "upper" in fired):
            from_nothing = not rounding < T_0
            if (
                self.C * self.R_b * omega_b < pull
                if from_nothing
                else tension < T_0 - rounding
            ):
                return TAKE_UP
        ratio = float(np.prod(self.static_ratios(y)))
        low = T_0 / ratio
        high = T_0 * ratio
        if slack and omega_b <= 0:
            tension = max(tension, low)
        for mode, sign in ((SLIP, 1), (BACK, -1)):
            if old == mode and "stick" in fired:
                continue
            self.mode = mode
            lead = sign * self.now(t, y).lead
            limit = self.sliding(t, y, mode == BACK)[0][-1]
            past = sign * (tension - limit)
            there = (
                tension >= high - rounding if sign > 0 else tension <= low + rounding
            )
            there = there or (old == mode and past >= -1e-8 * self.force)
            there = there or (
                old == ELASTIC and ("upper" if sign > 0 else "lower") in fired
            )
            if there and (lead > 0 or (lead == 0 and sign * direction > 0)):
                return mode
        return ELASTIC

    def _leaves(self, t, y):
        """Which limit an elastic band that has come to lie on one leaves at once, if
        any."""
        if self.mode != ELASTIC:
            return ""
        T_0 = self.lever(t)
        tension = self.C * self.stretch(y)
        ratio = float(np.prod(self.static_ratios(y)))
        speed = self.C * self.R_b * self.carrier(y)
        pull = self.lever.rate(t)
        spare = 1e-9 * self.force
        if tension <= T_0 / ratio + spare and speed < pull / ratio - spare:
            return "lower"
        return (
            "upper"
            if tension >= T_0 * ratio - spare and speed > pull * ratio + spare
            else ""
        )

    def _jump(self, t, y, old):
        """Elongation, lever work and heat where the tension changes at an instant."""
        self.clipped = False
        if self.C is None:
            return y
        x = self.stretch(y)
        T_0 = 0.0 if self.mode == OPEN else self.lever(t)
        T = y[self.T].copy()
        slack = old in (OPEN, TAKE_UP)
        heat = 0.0
        after = x
        trial = y.copy()
        for _ in range(60):
            ratio = float(np.prod(self.static_ratios(trial)))
            low = T_0 / ratio
            high = T_0 * ratio
            tension = max(self.C * x, low) if slack else self.C * x
            if self.mode == OPEN:
                tension = self.C * x if slack and old == OPEN else 0.0
            elif self.mode == ELASTIC:
                tension = min(max(tension, low), high)
            elif self.mode in SLIDES:
                tension = float(self.sliding(t, trial, self.mode == BACK)[0][-1])
            elif self.mode == TAKE_UP:
                tension = self.C * x
            after = tension / self.C
            heat = self.rims * (x - after) * (0.5 * self.C * (x + after) - T_0)
            if self.heat is None:
                break
            share = heat * self.p["beta"] / np.sum(self.p["beta"])
            still = Pair(np.zeros(self.n), np.zeros(self.n), 0.0)
            pairs = [Pair(share, still.normal, 0.0)] + (
                [] if self.bandage is None else [still]
            )
            trial[self.T] = T + self.friction_heat(pairs) / self.heat.capacity
        y = trial
        self.clipped = abs(after - x) * self.C > 1e-6 * self.force
        y[self.OWN.stop - 1] = after
        y[self.WORK.start + 1] += self.rims * T_0 * (after - x)
        y[self.WORK.start + 3] += heat
        return y

    def stored(self, y):
        return (
            0.0 if self.C is None else 0.5 * self.rims * self.C * self.stretch(y) ** 2
        )

    def kinetic_energy(self, y):
        more = (
            0.0
            if self.bandage is None
            else 0.5 * self.rims * self.bandage["J"] * float(y[self.OWN.start]) ** 2
        )
        return super().kinetic_energy(y) + more

    # --- the log ---------------------------------------------------------------------

    def limits_passed(self, t, y):
        """Linings past their limit: positive counted from the slack end, negative from
        the anchor."""
        if self.mode in SLIDES:
            return {*range(1, self.n + 1), *range(-self.n, 0)}
        if self.mode != ELASTIC:
            return set()
        T_0 = self.lever(t)
        tension = self.C * self.stretch(y)
        mu = self.static_ratios(y)
        ahead = np.cumprod(mu)
        behind = np.cumprod(mu[::-1])[::-1]
        spare = 1e-12 * self.force
        return {i + 1 for i in range(self.n) if tension > T_0 * ahead[i] + spare} | {
            -i - 1 for i in range(self.n) if tension * behind[i] < T_0 - spare
        }

    def _log(self, t, y, old, old_inner, old_limits):
        names = names_of_change(old, self.mode, self.first)
        if self.bandage is not None:
            names = names_with_a_bandage(
                names, (old, old_inner), (self.mode, self.inner)
            )
        if self.bandage is None and self.mode in (ELASTIC, *SLIDES):
            kept = old_limits if old in (ELASTIC, *SLIDES) else set()
            here = self.limits_passed(t, y)
            if self.mode in SLIDES:
                here = (
                    set(range(1, self.n + 1))
                    if self.mode == SLIP
                    else set(range(-self.n, 0))
                )
            elif old in SLIDES:
                here = set()
            for i in sorted(here - kept):
                self.note(t, "lining_limit", abs(i))
        for name in names:
            self.note(t, name)
