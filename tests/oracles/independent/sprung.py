"""The resolved bandage: linings on springs, each held or sliding on the band and on the
rim."""

from typing import NamedTuple

import numpy as np
from oracles.independent.base import (
    BACK,
    HELD,
    OPEN,
    ROUNDING,
    SLIP,
    Brake,
    Pair,
    law_of,
    names_of_change,
    names_with_a_bandage,
)
from scipy.optimize import brentq

#: shares at which the torque of linings at rest is looked at before its root is
#: bracketed
_SHARES = np.linspace(-1.0, 1.0, 201)


class Now(NamedTuple):
    """Forces and accelerations at one instant; arrays have one entry for each
    lining."""

    alpha: float  # of the pulley (rad/s²)
    tension: np.ndarray  # T_0…T_n (N)
    pull: np.ndarray  # by which the band holds a lining (N)
    pull_limit: np.ndarray  # up to which it is held there (N)
    drive: np.ndarray  # torque from the pulley (N·m)
    grip: np.ndarray  # up to which it sticks to the rim, or with which it slides (N·m)
    springs: np.ndarray  # torque of the springs (N·m)
    # torque that a lining at rest could bear from its springs beyond what it bears
    # (N·m)
    spare: np.ndarray
    acceleration: np.ndarray  # rad/s²
    least: float  # load torques between which a pulley at rest stays there (N·m)
    most: float
    # load of each lining on the rim, of one off the rim what it lacks to touch (N)
    margin: np.ndarray


class Sprung(Brake):
    """`J ω̇ = M − Σ λ_i`, `J_i ω̇_i = λ_i + Q_i − R_b (T_i − T_{i−1})`; states `e_j` of
    the springs, `ω_i`.

    `outer`, `inner`: 0 where a lining is held on the band or sticks to the rim, else
    the sense in which it slides. A lining that neither moves on the band nor on the rim
    is fixed, and so is the pulley then.
    """

    def __init__(self, p):
        q = p["bandage"]
        n = p["n"]
        speed = max(abs(p["omega"]), 1.0)
        super().__init__(p, 2, [*(p["lever"].largest() / q["spring"]), *[speed] * n])
        self.R = p["R"]
        self.R_b = p["R_b"]
        self.J_i = q["J"]
        self.K = q["spring"]
        self.preload = q["preload"]
        reduced = 1 / (self.R_b**2 * (1 / self.J_i[:-1] + 1 / self.J_i[1:]))
        self.D = 2 * q["damping"] * np.sqrt(self.K * reduced)
        self.thrust = q.get("mass", np.zeros(n)) * q.get("mass_radius", 0.0)
        self.off = np.zeros(n, bool)
        self.z = np.tan(p["beta"] / 2)
        self.sine = np.sin(p["beta"] / 2)
        self.rim_law = law_of(q["law"], p.get("fade"))
        self.outer = np.ones(n, int)
        self.inner = np.zeros(n, int)
        self.sense = -1 if p["omega"] < 0 else 1
        self.y[self.OWN][n - 1 :] = p["omega"]

    def label(self):
        outer = np.zeros(self.n, int) if self.mode == OPEN else self.outer
        return (
            self.mode,
            *map(int, outer),
            *map(int, np.where(self.off, 2, self.inner)),
        )

    @property
    def held(self):
        return (self.outer == 0) & (self.mode != OPEN)

    @property
    def fixed(self):
        return self.held & (self.inner == 0)

    def own(self, y):
        """Elongations (m), and speeds of the linings (rad/s) as the mode has them."""
        e, w = np.split(y[self.OWN], [self.n - 1])
        return e, np.where(self.held, 0.0, np.where(self.inner == 0, y[1], w))

    # --- all of it at one instant ----------------------------------------------------

    def _coefficients(self, y):
        """`f tan(β/2)` on the band, sticking and sliding, and the coefficients on the
        rim that count."""
        T = self.lining_temperatures(y)
        w = self.own(y)[1]
        sliding = self.law.kinetic(self.outer * w * self.R_b, T)
        on_rim = np.where(
            self.inner == 0,
            self.rim_law.static(T),
            self.rim_law.kinetic(self.inner * (y[1] - w) * self.R, T),
        )
        return (
            self.law.static(T) * self.z,
            sliding * self.z,
            np.where(self.off, 0.0, on_rim),
        )

    def _seat(self, y):
        """Preload less the centrifugal force (N)."""
        return self.preload - self.thrust * self.own(y)[1] ** 2

    def _along(self, T_0, y, springs, share):
        """Tensions `T_0…T_n` for shares of the grip that fixed linings use; which
        linings the band bounds then."""
        (still, moving, on_rim) = self._coefficients(y)
        seat = self._seat(y)
        before = np.full(np.shape(share), T_0)
        tensions = [before]
        bounded = []
        for i in range(self.n):
            by_load = self.R * on_rim[i] * self.sine[i]
            by_preload = self.R * on_rim[i] * seat[i]
            low = before * (1 - still[i]) / (1 + still[i])
            high = before * (1 + still[i]) / (1 - still[i])
            used = share if self.fixed[i] else float(self.inner[i])
            # R_b (T − T') = used (by_load (T + T') + by_preload) + Q
            balanced = (
                before * (self.R_b + used * by_load) + used * by_preload + springs[i]
            ) / (self.R_b - used * by_load)
            if self.fixed[i]:
                after = np.minimum(np.maximum(balanced, low), high)
            elif self.held[i]:
                after = balanced
            else:
                fz = self.outer[i] * moving[i]
                after = before * (1 + fz) / (1 - fz) if self.mode != OPEN else before
            bounded.append(np.where(share >= 0, balanced >= high, balanced <= low))
            tensions.append(after)
            before = after
        return np.array(tensions), np.array(bounded)

    def _taken(self, T_0, y, springs, share):
        """Torque (N·m) that the linings take from a pulley at rest."""
        tension, _ = self._along(T_0, y, springs, share)
        on_rim = self._coefficients(y)[2]
        total = np.zeros(np.shape(share))
        for i in range(self.n):
            if self.fixed[i]:
                total = total + self.R_b * (tension[i + 1] - tension[i]) - springs[i]
            else:
                load = (tension[i + 1] + tension[i]) * self.sine[i] + self._seat(y)[i]
                total = total + self.inner[i] * self.R * on_rim[i] * load
        return total

    def _share(self, T_0, y, springs, M):
        """The share of their grip with which fixed linings carry the load `M`, and the
        loads at shares −1 and 1.

        Where several would, the greatest of those about which the torque grows with the
        share.
        """
        taken = self._taken(T_0, y, springs, _SHARES)
        rises = np.flatnonzero((taken[:-1] < M) & (taken[1:] >= M))
        if rises.size:
            a = _SHARES[rises[-1]]
            b = _SHARES[rises[-1] + 1]
            root = brentq(
                lambda x: float(self._taken(T_0, y, springs, np.float64(x))) - M,
                a,
                b,
                xtol=1e-16,
                rtol=1e-15,
            )
            return float(root), taken[0], taken[-1]
        return (1.0 if taken[-1] < M else -1.0), taken[0], taken[-1]

    def forces_of_springs(self, y):
        """Torques on the linings (N·m), power of the dampers (W), rates of the
        elongations (m/s)."""
        e, w = self.own(y)
        rate = self.R_b * (w[:-1] - w[1:])
        force = np.concatenate([[0.0], self.K * e + self.D * rate, [0.0]])
        return (
            self.R_b * (force[:-1] - force[1:]),
            float(np.sum(self.D * rate**2)),
            rate,
        )

    def now(self, t, y):
        T_0 = 0.0 if self.mode == OPEN else self.lever(t)
        springs = self.forces_of_springs(y)[0]
        rests = bool(np.any(self.fixed))
        stuck = self.inner == 0
        held = self.held
        M = self.driving(t, 0.0 if rests else float(y[1]))
        share, least, most = (
            self._share(T_0, y, springs, M) if rests else (0.0, 0.0, 0.0)
        )
        tension, _ = self._along(T_0, y, springs, np.float64(share))
        still, _, on_rim = self._coefficients(y)
        before = tension[:-1]
        pull = np.diff(tension)
        both = tension[1:] + tension[:-1]
        balance = both * self.sine + self._seat(y)
        grip = self.R * on_rim * balance
        needed = self.R_b * pull - springs
        slid = self.inner * grip
        alpha = 0.0
        if not rests:
            alpha = (M - float(np.sum(np.where(stuck, needed, slid)))) / (
                self.J + float(np.sum(self.J_i[stuck]))
            )
        drive = np.where(stuck, needed + self.J_i * alpha, slid)
        # torn off by its springs: beyond the greatest pull of the band, and the grip on
        # the rim with that tension
        way = np.where(springs > 0, 1.0, -1.0)
        after = before * (1 + way * still) / (1 - way * still)
        bears = self.R * on_rim * (
            (after + before) * self.sine + self.preload
        ) + self.R_b * np.abs(after - before)
        acceleration = np.where(
            held, 0.0, np.where(stuck, alpha, (slid - needed) / self.J_i)
        )
        spare = bears - np.abs(springs)
        margin = np.where(self.off, -balance, balance)
        return Now(
            alpha,
            tension,
            pull,
            still * both,
            drive,
            grip,
            springs,
            spare,
            acceleration,
            least,
            most,
            margin,
        )

    def rates(self, t, y):
        now = self.now(t, y)
        (_, w) = self.own(y)
        (_, damping, stretching) = self.forces_of_springs(y)
        omega = 0.0 if np.any(self.fixed) else float(y[1])
        N = (now.tension[1:] + now.tension[:-1]) * self.sine
        outer = Pair(now.pull * self.R_b * w, N, self.R_b * w)
        rim = Pair(
            now.drive * (omega - w),
            np.abs(np.where(self.off, 0.0, now.margin)),
            self.R * (omega - w),
        )
        own = np.append(stretching, now.acceleration)
        return self.assembled(
            t, y, now.alpha, own, [outer, rim], damping=damping, omega=omega
        )

    def guards(self, t, y):
        now = self.now(t, y)
        (_, w) = self.own(y)
        omega = float(y[1])
        found = {}
        if np.any(self.fixed):
            M = self.driving(t, 0.0)
            found |= {
                "above": (now.most - M) / self.torque,
                "below": (M - now.least) / self.torque,
            }
        elif self.mode != OPEN:
            found["pulley"] = self.sense * omega / self.speed
        for i in range(self.n):
            if np.any(self.thrust) and not self.held[i]:
                found[f"lift {i}"] = now.margin[i] / self.force
            if self.fixed[i]:
                found[f"tear {i}"] = now.spare[i] / self.torque
                continue
            if self.held[i]:
                found[f"band {i}"] = (now.pull_limit[i] - abs(now.pull[i])) / self.force
                continue
            if self.inner[i] == 0:
                found[f"rim {i}"] = (now.grip[i] - abs(now.drive[i])) / self.torque
                continue
            if not self.off[i]:
                found[f"rim {i}"] = self.inner[i] * (omega - w[i]) / self.speed
            if self.mode != OPEN:
                found[f"band {i}"] = self.outer[i] * w[i] / self.speed
        return found

    # --- changes of mode -------------------------------------------------------------

    def change(self, t, y, fired):
        y = y.copy()
        old = (self.mode, self.sense, self.outer.copy(), self.inner.copy())
        e, w = self.own(y)
        y[self.OWN] = np.append(e, w)
        if np.any(self.fixed):
            y[1] = 0.0
        way = 1 if "above" in fired else -1 if "below" in fired else 0
        self._let_go_or_catch(t, y, fired)
        lifted = [int(name.split()[1]) for name in fired if name.startswith("lift")]
        self._lift(t, y, lifted)
        self._lever(y)
        if self.mode != OPEN and "pulley" in fired:
            y[1] = 0.0
            resting = self.held | (self.inner == 0)
            self.outer[resting] = self.inner[resting] = 0
        for _ in range(6 * self.n):
            y[self.OWN][self.n - 1 :] = self.own(y)[1]
            if not self._yields(t, y, way):
                break
            way = 0
        else:
            raise RuntimeError(f"no mode is consistent at {t:.9g} s")
        if np.any(self.thrust):
            self._lift(t, y, np.flatnonzero(self.off & self.held))
            jumped = np.flatnonzero(
                ~self.held & (self.now(t, y).margin < -ROUNDING * self.force)
            )
            self._lift(t, y, [i for i in jumped if i not in lifted])
        if self.mode != OPEN:
            rests = bool(np.any(self.fixed))
            omega = y[1]
            if not rests:
                self.sense = int(np.sign(omega)) or self._sets_off(t, y)
            self.mode = (
                HELD if np.all(self.outer == 0) else SLIP if self.sense > 0 else BACK
            )
        self._log(t, *old)
        self.first = False
        return y

    def _lift(self, t, y, linings):
        """Linings leave the rim, or touch it again and slide there by their speed."""
        for i in linings:
            self.off[i] = not self.off[i]
            self.note(
                t, "lining_lift_off" if self.off[i] else "lining_touchdown", int(i) + 1
            )
            way = np.sign(y[1] - self.own(y)[1][i])
            if self.off[i] and self.inner[i] == 0:
                self.inner[i] = 1 if self.now(t, y).drive[i] > 0 else -1
            elif not self.off[i] and way and self.inner[i]:
                self.inner[i] = int(way)

    def _let_go_or_catch(self, t, y, fired):
        """What guards of single linings have told: what slid has caught on, what stuck
        lets go."""
        now = self.now(t, y)
        rests = bool(np.any(self.fixed))
        fixed = self.fixed
        slid = (self.outer != 0) & (self.inner != 0)
        ahead = int(np.sign(y[1]))
        for name in fired:
            what, _, number = name.partition(" ")
            if not number:
                continue
            i = int(number)
            if what == "tear":
                self._tear(i, now)
            elif what == "rim" and self.inner[i] == 0 and not fixed[i]:
                self.inner[i] = 1 if now.drive[i] > 0 else -1
            elif what == "band" and self.outer[i] == 0 and not slid[i]:
                self.outer[i] = 1 if now.pull[i] > 0 else -1
            elif what == "rim":
                self.inner[i] = 0
                self.outer[i] = 0 if rests else (ahead or self.sense)
            elif what == "band":
                self.outer[i] = 0
                self.inner[i] = 0 if rests else (ahead or self.sense)

    def _tear(self, i, now):
        self.outer[i] = 1 if now.springs[i] > 0 else -1
        self.inner[i] = -self.outer[i]

    def _lever(self, y):
        """The lever begins to pull, or lets go."""
        if self.pulls and self.mode == OPEN:
            _, w = self.own(y)
            self.mode = SLIP  # closed; its name comes at the end
            self.outer = np.sign(w).astype(int)
            self.inner = np.where((w == 0) & (y[1] == 0), 0, self.inner)
        elif not self.pulls:
            self.mode = OPEN

    def _yields(self, t, y, way):
        """Let go of what is held by too great a force, and hold what would go the other
        way; whether anything was."""
        now = self.now(t, y)
        spare = ROUNDING * self.torque
        if np.any(self.fixed):
            M = self.driving(t, 0.0)
            way = way or int(M - now.most > spare) - int(now.least - M > spare)
            if way:
                self._start(t, y, way)
                return True
            torn = np.flatnonzero(self.fixed & (now.spare < -spare))
            for i in torn:
                self._tear(int(i), now)
            if torn.size:
                return True
        off_rim = (
            (self.inner == 0) & ~self.held & (np.abs(now.drive) > now.grip + spare)
        )
        off_band = (
            self.held
            & ~self.fixed
            & (np.abs(now.pull) > now.pull_limit + ROUNDING * self.force)
        )
        self.inner[off_rim] = np.where(now.drive > 0, 1, -1)[off_rim]
        self.outer[off_band] = np.where(now.pull > 0, 1, -1)[off_band]
        if np.any(off_rim | off_band):
            return True
        return self._catches(y, now)

    def _catches(self, y, now):
        """Linings without speed on one of their faces that would slide there against
        their sense stay."""
        _, w = self.own(y)
        slides = (self.inner != 0) & ~self.held & ~self.off
        slight = 1e-9 * self.torque / self.J_i
        wrong = (
            slides
            & (w == y[1])
            & (self.inner * (now.alpha - now.acceleration) < -slight)
        )
        self.inner[wrong] = 0
        if self.mode != OPEN and not np.any(wrong):
            wrong = (
                slides
                & (w == 0)
                & (y[1] != 0)
                & (self.outer * now.acceleration < -slight)
            )
            self.outer[wrong] = 0
        return bool(np.any(wrong))

    def _start(self, t, y, way):
        """The pulley starts, and every fixed lining lets go where it is held less."""
        springs = self.forces_of_springs(y)[0]
        _, bounded = self._along(self.lever(t), y, springs, np.float64(way))
        fixed = self.fixed
        self.sense = way
        self.outer = np.where(fixed, np.where(bounded, way, 0), self.outer)
        self.inner = np.where(fixed, np.where(bounded, 0, way), self.inner)

    def _sets_off(self, t, y):
        """The sense in which a pulley without speed begins to turn."""
        torque = self.J * self.now(t, y).alpha
        return self.sense if abs(torque) < 1e-9 * self.torque else int(np.sign(torque))

    def stored(self, y):
        return 0.5 * float(np.sum(self.K * self.own(y)[0] ** 2))

    def bandage_speeds(self, y):
        return self.own(y)[1]

    def kinetic_energy(self, y):
        return super().kinetic_energy(y) + 0.5 * float(
            np.sum(self.J_i * y[self.OWN][self.n - 1 :] ** 2)
        )

    # --- the log ---------------------------------------------------------------------

    def _log(self, t, mode, sense, outer, inner):
        slid, slides = (
            0 if np.all(one == 0) else way
            for one, way in ((inner, sense), (self.inner, self.sense))
        )
        names = names_of_change(mode, self.mode, self.first)
        for name in names_with_a_bandage(names, (mode, slid), (self.mode, slides)):
            self.note(t, name)
        pairs = (
            ("internal", inner, self.inner),
            ("external", np.where(mode == OPEN, 2, outer), self._on_band()),
        )
        for where, was, now in pairs:
            for i in np.flatnonzero((was == 0) != (now == 0)):
                self.note(
                    t,
                    f"lining_{where}_{'stick' if now[i] == 0 else 'slip'}",
                    int(i) + 1,
                )

    def _on_band(self):
        """`outer`, 2 where an open band touches no lining."""
        return np.where(self.mode == OPEN, 2, self.outer)
