#pragma once

#include "sysid/estimation/fit.h"

namespace sysid {

// What the model misses, beside the sensors' noise: a random generalised force
// on each degree of freedom, with a standard deviation and one correlation
// time, the likeliest ones (docs/theory.md, section 6). The residuals are then
//
//   r = e + A phi,   e white, of variance v,   phi ~ N(0, P^-1), (7.8),   (6.6)
//
// A what forces do to them. The estimate of least squares moves with both:
//
//   Cov = N^-1 [ (A' W)' P^-1 (A' W) + v N ] N^-1,   N = W' W,            (6.7)
//
// W the derivatives of all residuals by theta where the states follow it.
// (Huber 1967; White 1982.) A' W takes one pass backwards through each segment.

// Fills in `discrepancy` and, with it, the standard errors of a fit by shooting
// of this problem. Of one whose error is that of the noise nothing changes, nor
// where the dynamics fail.
void AddDiscrepancy(const ShootingProblem& problem, Fit* fit);

// That an effect of the fit's model is none: Wald's test of those of its
// parameters in which the law is linear, e, against their nominal values in
// `given`, or where the law is off, e_0. With C the covariance of what the data
// determines, U the moves that it does not, of unit variance each (Estimates),
//
//   z = (e - e_0)' (C_ee + U_e U_e')^-1 (e - e_0)                       (7.15)
//
// is chi-squared. Where no efforts were measured masses and friction may be
// scaled together: U takes friction to none, but the masses with it. So where
// the shortest such move, U U_e^+ (e_0 - e), leads another parameter to its
// bound, there is no such model, and C alone counts. 0 where bounds hold all e.
// Of one parameter that is none at its bound, half of that: by chance it would
// be on the other side as often, and end there (Self and Liang 1987, case 5).
double PValueOf(const Effect& effect, const Model& given, const Fit& fit);

}  // namespace sysid
