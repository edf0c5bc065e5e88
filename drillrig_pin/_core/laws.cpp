#include "laws.hpp"

#include <algorithm>
#include <cmath>

namespace drillrig {

namespace {

constexpr double kTwoPi = 6.283185307179586476925286766559;

double oil(const double* p, double x, double x_dot, bool printed) {
  const double x0 = p[0], E0 = p[1], S_A = p[2], S_B = p[3], l_A = p[4], l_B = p[5], k = p[8];
  const double u = x - x0;
  const double p_A = p[6] - E0 * std::log1p(u / l_A);
  const double p_B = printed ? p[7] + E0 * std::log1p(u / l_B) : p[7] - E0 * std::log1p(-u / l_B);
  return p_A * S_A - p_B * S_B - k * x_dot;
}

// From 0 to 1 without a jerk at either end.
double ramp(double s) { return s * s * s * (10.0 + s * (6.0 * s - 15.0)); }

double harmonic(const Law& law, const double* series, double t) {
  double sum = 0.0;
  for (int i = 0; i < law.count; ++i) {
    const double* term = series + law.first + 3 * i;
    sum += term[0] * std::sin((kTwoPi * t) * term[1] + term[2]);
  }
  const double value = law.p[0] + sum;
  return t < law.p[1] ? ramp(t / law.p[1]) * value : value;
}

// Rows of five: knot time and coefficients of d^3, d^2, d, 1 with d the time since the knot; the last row ends the table.
double table(const Law& law, const double* series, double at) {
  const double* rows = series + law.first;
  const int n = law.count;
  const double t = std::min(std::max(at, rows[0]), rows[5 * (n - 1)]);
  int low = 0, high = n - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (rows[5 * middle] <= t ? low : high) = middle;
  }
  const double* row = rows + 5 * low;
  const double d = t - row[0];
  const double value = ((row[1] * d + row[2]) * d + row[3]) * d + row[4];
  return law.p[0] > 0.0 && at < law.p[0] ? ramp(at / law.p[0]) * value : value;
}

double depth_of(const double* p, double x) { return x - p[0] + p[1] / p[2]; }

}  // namespace

int switch_count(const Law& law) {
  return law.kind == LawKind::unilateral_contact ? 2 : law.kind == LawKind::callback ? law.count : 0;
}

bool depends_on_time_alone(const Law& law) { return law.kind == LawKind::harmonic || law.kind == LawKind::table; }

LawValue evaluate(const Law& law, int index, const LawContext& context, double x, double x_dot, double t) {
  const double* p = law.p;
  LawValue value;
  switch (law.kind) {
    case LawKind::locked_oil:
    case LawKind::locked_oil_as_printed:
      value.force = oil(p, x, x_dot, law.kind == LawKind::locked_oil_as_printed);
      value.dissipation = p[8] * x_dot * x_dot;
      break;
    case LawKind::spring_damper:
      value.force = p[1] - p[2] * (x - p[0]) - p[3] * x_dot;
      value.dissipation = p[3] * x_dot * x_dot;
      break;
    case LawKind::constant_force:
      value.force = p[0];
      break;
    case LawKind::bilateral_contact:
      value.force = -(p[1] + p[2] * (x - p[0]) + p[3] * x_dot);
      value.dissipation = p[3] * x_dot * x_dot;
      break;
    case LawKind::unilateral_contact: {
      const double depth = depth_of(p, x);
      value.force = depth > 0.0 ? -std::max(0.0, p[2] * depth + p[3] * x_dot) : 0.0;
      value.dissipation = -(value.force + p[2] * std::max(0.0, depth)) * x_dot;
      break;
    }
    case LawKind::harmonic:
      value.force = harmonic(law, context.series->data(), t);
      break;
    case LawKind::table:
      value.force = table(law, context.series->data(), t);
      break;
    case LawKind::joint_friction:
      value.force = -p[0] * x_dot - p[1] * std::tanh(x_dot / p[2]);
      value.dissipation = -value.force * x_dot;
      break;
    case LawKind::callback:
      value.ok = context.callback.evaluate(context.callback.owner, index, x, x_dot, t, &value.force, &value.dissipation);
      break;
  }
  return value;
}

bool switches(const Law& law, int index, const LawContext& context, double x, double x_dot, double* out) {
  if (law.kind == LawKind::callback)
    return context.callback.switches(context.callback.owner, index, x, x_dot, law.count, out);
  const double depth = depth_of(law.p, x);
  out[0] = depth;
  out[1] = law.p[2] * depth + law.p[3] * x_dot;
  return true;
}

}  // namespace drillrig
