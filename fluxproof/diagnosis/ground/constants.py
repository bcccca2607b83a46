# SPDX-License-Identifier: BSD-3-Clause
"""Every number that decides an answer and is a choice, with its unit and its reason; `make sensitivity` varies each.

What only limits effort (how many sets are tried), grids and tolerances of a numerical step stand where they are used.
"""

# ---- what a recording may contain
# Prior probability that a given effect of the catalogue is present: of some twenty effects one is expected.
PRESENT = 0.05
# Odds of a parameter outside of what its effect declares as plausible: absurd errors that cancel may fit as well as the
# true ones.
IMPLAUSIBLE = 1e-3
# Exponent with which an effect below the smallest size of practical interest becomes improbable: no steep edge, beside
# which a real error of a sensor would be replaced by larger ones that cancel; what is found and too small is a note.
SMALLER = 5.0
# Error of the balance that no parameter explains, relative to the voltage of an operating point: PWM ripple, the
# trapezoidal mean of the current, the converters' timing.
BALANCE_U = 2e-4
# The same relative to the bus voltage: sampling of the bus, minimum pulses.
BALANCE_DC = 1.5e-5
# Error of a harmonic relative to that of the mean voltage or torque: ripple and timing affect harmonics less.
BALANCE_ORDER = 0.5
# Error of the balance that all operating points share and that biases a parameter, relative to the voltage, and to the
# bus voltage in the direction of the current: rms in healthy recordings.  It is part of every set of effects.
COMMON_U, COMMON_DC = 2e-5, 1e-5
# Error of the mean of three phase currents, relative to the rated current: matching of the converters' references.
BALANCE_SUM = 2e-4
# Error of the torque balance, relative to the rated torque: a transducer's linearity, slow friction.
BALANCE_TORQUE = 3e-3
# Scale of the discrepancy in units of the balance's error, and the exponent with which its prior falls beyond it.
DISCREPANCY, STEEP = 3.0, 4.0
# Relative error of the formula of an effect at each operating point.
FORMULA = 0.01
# Departure from the formula, relative to the usual one (an effect's ``curve``), that counts as no departure.
STRAIGHT = 0.01
# Largest size of an effect, in units of the smallest of interest, where a ceiling limits it, and where none does.
WIDEST, UNBOUNDED = 1e3, 300.0
# Odds against a load that nobody recorded at every operating point: a brake is off at one of them.  A load that drives
# the shaft somewhere, as gravity or another machine does, may act everywhere.
ALWAYS_LOADED = 1e4
# Distance relative to top speed and rated current below which blocks belong to one operating point, as the drive
# regulates both.
POINT = 0.08
# Visits into which a recording of a single operating point is cut: enough to show a drift, each long enough for a mean.
VISITS = 16
# Largest power of a ripple that repeats at an operating point, relative to its variance, that counts as noise: 2 sigma.
RIPPLE = 4.0
# Misfit, relative to the voltage, above which an effect that is far from linear is approached from several starts: an
# angle that is off by a third of a radian leaves as much.
FAR = 0.3

# ---- interpretation of recording and drive file
# Prior probability of each mistaken convention (conventions/table.py): of 35, one recording in fourteen has one.
MISREAD = 2e-3
# Log evidence that any effect costs: prior odds of 1 to 19, and the width of its prior.  A convention that cannot gain
# as much by leaving no effect is not searched.
ONE_EFFECT = 7.0
# Odds at which a convention that leaves more than the usual error is preferred to free sizes of the constants.
CLEARLY = 20.0
# Least number of operating points: at fewer some convention meets any constant misfit.
READ_POINTS = 3
# Share of the voltage that R, L_d, L_q or psi_m must make to be seen beside the error of a real table.
EXCITED = 0.01
# Remainder, in usual errors, that no recording is exact enough for: a convention that leaves less has lost its rows.
TOO_EXACT = 1e-6
# Difference of two remainders, relative to one, below which two conventions leave the same.
SAME_BALANCE = 1e-6

# ---- what is reported
# Largest probability of absence at which an effect, or one effect of an alternative, is still reported.
DOUBTED = 0.05
# Probability that one of several causes is large enough to act on, from which their ambiguity is reported.
ACTED_ON = 2 / 3
# Standard deviations above which an effect has a size of its own in a set: with less the set says what others say too.
SIZED = 1.0
# Probability mass of the least probable sets, which are ignored.
LEFT_OUT = 0.05
# Least probability of an effect in an ambiguity.
OPEN = 0.02
# Difference of an effect's parameter, relative to it, between alternatives that makes it a part of what is not known.
DEPENDS = 0.2
# The same in standard deviations, below which the alternatives agree.
SURE = 3.0
# Least probability at which an effect that is not reported still counts towards the explained share.
LIKELY = 0.5
# Discrepancy, in standard deviations of the balance's error, that is accepted without penalty.
USUAL = 1.5
# Largest ratio of an effect to the residual at which the residual may imitate it: smooth physics has few directions.
IMITATION = 2.0
# Largest probability of imitation at which an effect counts as real, so that the residual may be an error of it.
IMITATED = 1e-3
# Least share of an effect's power for an order to count as one of its own; weight of the residual in all other orders.
LIVES = 0.05
ELSEWHERE = 0.1
# Power above the noise floor, relative to the floor's power, below which a misfit is noise.  3: twice the floor's rms.
FLOOR = 3.0
# The same for a single order, below which it is not evaluated.  0.44: 1.2 times the floor's rms.
VISIBLE = 0.44
# Order of the sum of three phase currents, relative to the rated current, that ordinary sensors leave: class 0.3.
RELEVANT_SUM = 1.5e-3
# Share of the misfit's power above the floor below which a residual is the formulas' own error.
SMALL = 0.03
# Least share of that power that the reported effects must explain.
HALF = 0.5
# Share of the power of one order above which a residual over its noise floor is significant.
STANDS_OUT = 0.1
# Share of the power of all orders of a channel below which an order is not listed in the remainder.
LISTED = 0.01
# Residual, in noise floors, that the headline reports although the misfit is explained.
MUCH_LEFT = 3.0
# Least ratio of the misfit inside and outside of a reported region of speed, current, temperature, bus or time.
REGION = 1.5
# Distance, in control periods and in standard deviations, within which a time counts as a whole number of periods, as
# a wrong register of the timing makes it.
WHOLE_PERIOD, WHOLE_SIGMAS = 0.01, 3.0
# Difference from the recorded voltage in the closed loop, relative to that with the nominal drive, from which an
# improved drive file is not written.
MUCH_WORSE = 1.1
# Share of an effect's longest column below which the recording does not show a coefficient, so that one is requested.
SHOWN = 0.06

# ---- a misfit outside the orders of the balance
# Ripple that the formulas of the reported effects may leave, relative to the misfit's rms.
FORMS_LEFT = 0.06
# Power of the sum over the sum of powers of a misfit that is locked to the rotor; exp(-30) by chance.
LOCKED = 30.0
# Ripple relative to the voltage that is attributed to the inverter; the same for an oscillation at its own frequency.
LEAST_RIPPLE = 1.5e-3
LEAST_SWING = 4e-3
# Smallest torque ripple that is searched for, relative to the rated torque.
LEAST_TORQUE = 0.01
# Ratio of a peak to the noise spectrum around it from which it counts as an oscillation.
SWING = 8.0

# ---- operating points: slow logs and tables
# Resolution and timing of messages, ripple and clamping, relative to the bus and to the voltage; share of the voltage's
# change around a stretch, as a row combines messages of different age.
SLOW_DC, SLOW_U, SLOW_CHANGE = 2.5e-4, 2e-3, 0.05
# Smallest error of a log relative to that error: a table of long means is better than bus messages.
SLOW_LEAST = 0.2
# Largest noise relative to the voltage that is estimated from the residual, where operating points repeat too seldom to
# show it; a larger residual is not noise.
UNREPEATED = 0.03

# Angle that a mean over blocks covers, turns: what is then left of order six of the inverter's loss is small.
WHOLE_TURN = 0.95

# ---- one operating point
# Largest reduced chi^2 of an accepted drift; residual rms relative to the misfit that the shapes of curves may cause;
# least share of its power that drifts must explain where a residual remains, as that may imitate an effect.
LEFTOVER, FLOOR_SHARE, NAMED_SHARE = 2.0, 0.15, 0.9
# Penalty of an effect in chi^2, in addition to that of its coefficients: a prior probability of one in 150.
PER_EFFECT = 10.0
# Least number of means over time: fewer do not determine a drift.
LEAST_MEANS = 12
# Least change of a column over time, relative to its size, for its effect to drift.
DRIFTS = 0.1
# Difference of the score below which two sets of drifts fit equally well; 10 is a likelihood ratio of 150.
TIE = 10.0
# Cosine of two columns above which they are the same: then warming copper is no alternative.
SAME_COLUMN = 0.999
# Constant misfit, relative to the bus and to the voltage, that may be ripple or resolution; multiple of it within which
# a single effect explains the constant misfit.
CONSTANT_DC, CONSTANT_U, FITS = 1e-3, 5e-3, 3.0

# ---- fleets
# Largest share of false ones among the reported findings, and among the reported rates.
FLEET_FALSE = 0.05
# Share of healthy drives in which a drift is reported at some time, however often one looks.
DRIFT_ALARM = 0.01
# Confidence of the interval in which a drift reaches its limit.
DRIFT_CONFIDENCE = 0.95
# Least number of recordings of a drift: a line through fewer has hardly a scatter to be judged by.
DRIFT_RECORDINGS = 5
# Distance, 1 minus the cosine of two signatures, within which remainders are alike; least number of drives of a group.
GROUP_APART, GROUP_DRIVES = 0.35, 3
# Share of the fleet from which an effect is a property of the design, so that its size is compared.
COMMON = 0.2
# Least number of drives: fewer tell no outlier from a spread; with two, spread and mean cannot be separated.
OUTLIER_DRIVES, POPULATION_DRIVES = 8, 3
# Spread of the faulty drives relative to that of the others; largest share of them, as more are a population of their
# own; one in so many drives is faulty before any is seen.
FAULTY_WIDE, MOST_FAULTY, ONE_FAULTY_IN = 10.0, 0.3, 30.0
# Recordings that the prior rate of an effect counts as; the most that a fleet makes of an effect's prior probability.
RATE_WORTH, FLEET_EVEN = 2.0, 0.5
# Sigma over value, or over the least sigma of a set, from which a recording does not determine a parameter.
USELESS = 10.0
# Of the error that a trim cancels: an error found that is nearer to it is that error, recorded without the trim.
SAME_TRIM = 0.25
