"""Every number that decides what is said and is a choice, with its unit and its reason; `make sensitivity` varies each.

What only limits effort (how many sets are tried), grids and tolerances of a numerical step stand where they are used.
"""

# ---- what a recording may contain
# Prior probability that a given effect of the catalogue is present: of some twenty effects one is expected.
PRESENT = 0.05
# Odds of a parameter outside of what its effect declares as plausible: absurd errors that cancel may fit as well as the
# true ones.
IMPLAUSIBLE = 1e-3
# Power of its size with which an effect that is smaller than what is of practical interest becomes improbable: a steep
# edge, as nobody asks for smaller ones, but none that forbids what is clearly seen.
SMALLER = 30.0
# Error of the balance that no parameter explains, relative to the voltage of an operating point: PWM ripple, the
# trapezoidal mean of the current, the converters' timing.
BALANCE_U = 2e-4
# The same relative to the bus voltage: sampling of the bus, minimum pulses.
BALANCE_DC = 1.5e-5
# Of the error of a mean voltage or torque, what a harmonic has: less of the ripple and of the timing reaches it.
BALANCE_ORDER = 0.5
# The part of the balance's error that all operating points have in common and that moves a parameter, relative to the
# voltage, and to the bus voltage in the direction of the current: rms in healthy recordings.  It is in every set.
COMMON_U, COMMON_DC = 2e-5, 1e-5
# Error of the mean of three phase currents, relative to the rated current: matching of the converters' references.
BALANCE_SUM = 2e-4
# Error of the torque balance, relative to the rated torque: a transducer's linearity, slow friction.
BALANCE_TORQUE = 3e-3
# Scale of the discrepancy in units of the balance's error; its prior falls as the square beyond it.
DISCREPANCY = 3.0
# Share of its own contribution by which the formula of an effect is wrong at each operating point.
FORMULA = 0.01
# Share of the usual departure from the formula (an effect's ``curve``) below which a curve is as good as the formula.
STRAIGHT = 0.01
# Largest size of an effect, in units of the smallest of interest, where a ceiling limits it, and where none does.
WIDEST, UNBOUNDED = 1e3, 300.0
# Odds against a load that nobody recorded at every operating point: a drive is run without load at one of them.
ALWAYS_LOADED = 1e4
# Of the top speed and the rated current: closer blocks belong to one operating point, as a drive regulates them.
POINT = 0.08
# Visits into which a recording of a single operating point is cut: enough to show a drift, each long enough for a mean.
VISITS = 16
# Power of a ripple that repeats at an operating point, in units of its variance, that is noise: 2 standard deviations.
RIPPLE = 4.0

# ---- how recording and drive file are to be read
# Prior probability of each mistaken convention (conventions/table.py): of 35, one recording in fourteen has one.
MISREAD = 2e-3

# ---- what the answer says
# Probability of not being there up to which an effect is named, or one of an alternative is taken to be there.
DOUBTED = 0.05
# Mass of the posterior that is not looked at: its sets are many, and each is improbable.
LEFT_OUT = 0.05
# Probability from which an effect is an alternative.
OPEN = 0.02
# Sum of the probabilities of an alternative's effects from which it is told.
TOGETHER = 0.5
# Probability from which an effect that is not named takes part in what is explained.
LIKELY = 0.5
# Discrepancy, in units of the balance's error, that every recording may have.
USUAL = 1.5
# A leftover imitates an effect up to this many times its own rms: smooth physics lies along a few directions only.
IMITATION = 2.0
# Probability of being an imitation up to which an effect is taken as real, so that a leftover may be an error of it.
IMITATED = 1e-3
# Share of an effect's power in an order from which it lives there; weight of what is left in its other orders.
LIVES = 0.05
ELSEWHERE = 0.1
# Power of a misfit above the noise floor, in units of the floor's own power: less is noise.  3: twice the floor's rms.
FLOOR = 3.0
# The same for a single order: a smaller misfit is not evaluated.  0.44: 1.2 times the floor's rms.
VISIBLE = 0.44
# Of the misfit's power above the floor: a smaller remainder is the formulas' own error.
SMALL = 0.03
# Of that power: names that explain less are no explanation.
HALF = 0.5
# Of the power of one order: a remainder above its noise floor that is larger stands out, so that something is there.
STANDS_OUT = 0.1
# Of the power of all orders of a channel: a smaller part is not listed in the remainder.
LISTED = 0.01

# ---- a misfit outside the orders of the balance
# Of the misfit's rms: ripple that the formulas of the named effects may leave.
FORMS_LEFT = 0.06
# Power of the sum over the sum of powers of a misfit that is locked to the rotor; exp(-30) by chance.
LOCKED = 30.0
# Of the voltage: smaller ripple is attributed to the inverter; the same of a swing at a frequency of its own.
LEAST_RIPPLE = 1.5e-3
LEAST_SWING = 4e-3
# Of the rated torque: a smaller ripple is not looked for.
LEAST_TORQUE = 0.01
# Low end of the rising noise spectrum over its neighbourhood, from which it is a swing.
SWING = 8.0

# ---- operating points: slow logs and tables
# Resolution and timing of messages, ripple and clamping, relative to the bus and to the voltage; share of the voltage's
# change around a stretch, as a row combines messages of different age.
SLOW_DC, SLOW_U, SLOW_CHANGE = 2.5e-4, 2e-3, 0.05
# Of that error: what a log may have at least, as a table of long means is better than messages of a bus.
SLOW_LEAST = 0.2
# Of the voltage: largest noise that may be taken from what no effect explains, where operating points repeat too seldom
# to show it; a larger remainder is no noise.
UNREPEATED = 0.03

# ---- one operating point
# Largest reduced chi^2 of an accepted drift; share of the misfit's rms that may be left to the shapes of curves; share
# of its power that names must explain beside a remainder, as it is not known how much may imitate an effect.
LEFTOVER, FLOOR_SHARE, NAMED_SHARE = 2.0, 0.15, 0.9
# Penalty of an effect in chi^2, in addition to that of its coefficients: a prior probability of one in 150.
PER_EFFECT = 10.0
