// Scalar force laws F(x, x_dot, t): twins of drillrig_pin/elements, formula for formula.
#pragma once

#include <vector>

namespace drillrig {

enum class LawKind : int {
  locked_oil,             // x0 E0 S_A S_B l_A l_B p_A0 p_B0 k
  locked_oil_as_printed,  // the same
  spring_damper,          // x0 F0 c k
  constant_force,         // F0
  bilateral_contact,      // x0 N0 c k
  unilateral_contact,     // x0 N0 c k
  harmonic,               // mean ramp, then terms in `series`: amplitude frequency phase
  table,                  // ramp, then knots in `series`: t, then four coefficients of the cubic behind it
  joint_friction,         // k F_c w
  callback,               // a law of the user's, evaluated by whoever owns it
};

// What a callback law does: writes force and dissipated power for x, x_dot, t. False: it failed.
struct LawCallback {
  bool (*evaluate)(void* owner, int index, double x, double x_dot, double t, double* force, double* lost);
  bool (*switches)(void* owner, int index, double x, double x_dot, int count, double* out);
  void* owner;
};

struct Law {
  LawKind kind;
  bool load;
  double p[9];
  int first = 0, count = 0;  // range in the series of the rig; callback: number of switching functions
};

// Number of switching functions of a law.
int switch_count(const Law& law);

// Whether a law is known ahead of the motion and varies: a load that is the same at all times follows from its past.
bool depends_on_time_alone(const Law& law);

struct LawContext {
  const std::vector<double>* series;
  LawCallback callback;
};

struct LawValue {
  double force = 0.0;
  double dissipation = 0.0;  // 0 for loads
  bool ok = true;
};

LawValue evaluate(const Law& law, int index, const LawContext& context, double x, double x_dot, double t);
// False: a callback failed.
bool switches(const Law& law, int index, const LawContext& context, double x, double x_dot, double* out);

}  // namespace drillrig
