"""Thresholds of the loop: shares of a step, of a run, of a tolerance, each with its
reason."""

#: relative rounding of float64
EPS = 2.220446049250313e-16

# --- length of the next step (Hairer, Nørsett & Wanner, *Solving ODEs I*, II.4) ------

#: share of the length that an error estimate allows: a step that is rejected costs a
#: whole one
SAFETY = 0.9
#: least and greatest change of the length from one step to the next: further away an
#: estimate says nothing
SHRINK = 0.2
GROW = 10.0
#: an estimate counts as no smaller: its power would be infinite
LEAST_ERROR = 1e-30
#: tangents are held to the geometric mean of this and the tolerance of values: fewer
#: digits are asked of derivatives
OF_TANGENTS = 1e-8
#: a step that ends this close before a time breakpoint ends on it: the rest would be a
#: step of its own
REACH = 1.001
#: first look after a restart: the step in which the state moves by this share of itself
FIRST_LOOK = 0.01
#: states or rates, over the tolerance, below which they give no time scale; then the
#: look is that share of the run
NO_SCALE = 1e-5
SHARE_OF_RUN = 1e-6
#: rates, over the tolerance, below which nothing limits the first step
NO_RATE = 1e-15
#: the first step is at most so many looks long
LONGEST_FIRST = 100

# --- differences of time -------------------------------------------------------------

#: roundings of a time that cannot be told from 0; and the time near 0, as a share of
#: the run, that counts as no smaller
ROUNDINGS = 8
SHARE_OF_TIME = 1e-3
#: a step shorter than this share of the resolution moves no time: the run ends
TOO_SHORT = 0.25
#: steps up to so many resolutions may be too short to move a state by what its rate
#: adds
HIDING = 64
#: of such a step a guard may be so many steps from zero, while it has moved by less
#: than this share of its rate
STILL_STEPS = 2
STILL_SHARE = 0.5
#: events of one guard closer together than this share of the run, so many of them, are
#: a Zeno point
ZENO_INTERVAL = 1e-6
ZENO_COUNT = 20

# --- guards, which are of order one --------------------------------------------------

#: rounding of a guard
TINY = 1e-15
#: a limit exceeded by no more than this is touched: rounding of guards that are
#: differences of numbers of order 100
TOUCH = 1e-12
#: a guard this close to 0, as a share of the tolerance and beside it, counts as reached
#: after a landing
REACHED = 0.1
REACHED_AT_LEAST = 1e-13
#: a move along the rates is as exact as a step if it is shorter than this share of the
#: step times √tolerance, as its error is of second order; or than this share of the
#: resolution
NEAR = 0.1
NEAR_AT_LEAST = 0.5
#: roundings by which a guard must leave zero to rise, and which a bend of its cubic has
#: to exceed
RISING = 2
BENDING = 100
#: a guard this many tolerances below 0 at the start of a step is no rounding, even on
#: its way up
DEEP = 1e3
#: a guard below this share of a tolerance under 0 fires at once: the steps left would
#: be too short to move a state
SUNK = 0.5
#: share of a drop within a step that the slope at its start has to explain
EXPLAINED = 0.5
#: retakes of one step after which it is halved in place of aiming at the root of the
#: cubic
AIMED = 8
#: places of a step between which the first root of a cubic is looked for, and
#: refinements that find it to rounding
SAMPLES = 16
REFINEMENTS = 8
#: minima this close to the ends of a step, as shares of it, are those of the ends
INSIDE = 0.02
#: a minimum is looked at where it lies below this share of the ends, which are this
#: many tolerances away from 0
LOW = 0.1
HIGH = 10
