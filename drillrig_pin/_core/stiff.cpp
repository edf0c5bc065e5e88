#define BOOST_UBLAS_NDEBUG 1

#include "stiff.hpp"

#include <algorithm>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <cmath>

namespace drillrig {

namespace {
using Vector = boost::numeric::ublas::vector<double>;
using Matrix = boost::numeric::ublas::matrix<double>;
// Steps of the difference quotients for positions, velocities and time. Oil turns the rounding of a length into noise of
// about 1e-8 m/s^2 in the accelerations, which these steps keep below 1e-6 of the quotient; in velocity the equations are
// all but linear, so that its step may be larger.
constexpr double kPosition = 1e-7, kVelocity = 1e-5, kTime = 1e-7;

// odeint (Boost 1.90) carries d4 with the wrong sign: for loads that depend on time the order falls to one. The value is
// that of Hairer and Wanner, Solving Ordinary Differential Equations II, code RODAS.
struct Coefficients : boost::numeric::odeint::default_rosenbrock_coefficients<double> {
  const double d4 = -0.3620000000000023e-01;
};
}  // namespace

struct StiffStep::Impl {
  explicit Impl(Dynamics& d)
      : dynamics(d), n(d.size()), base(n), moved(n), y(n), y_new(n), error(n), inside(n) {}

  void rate(const Vector& state, Vector& out, double t) {
    ++evaluations;
    const Status now = dynamics.rate(t, &state[0], &out[0]);
    if (status == Status::completed) status = now;
  }

  // Work done and work dissipated, the last two components, influence nothing: their columns are zero.
  void jacobian(const Vector& state, Matrix& J, double t, Vector& dfdt) {
    rate(state, base, t);
    moved = state;
    for (int k = 0; k < n; ++k) {
      if (k >= n - 2) {
        for (int i = 0; i < n; ++i) J(i, k) = 0.0;
        continue;
      }
      const double delta = (k < dynamics.nq ? kPosition : kVelocity) * std::max(1.0, std::abs(state[k]));
      moved[k] = state[k] + delta;
      rate(moved, dfdt, t);
      for (int i = 0; i < n; ++i) J(i, k) = (dfdt[i] - base[i]) / (moved[k] - state[k]);
      moved[k] = state[k];
    }
    rate(state, dfdt, t + kTime);
    for (int i = 0; i < n; ++i) dfdt[i] = (dfdt[i] - base[i]) / kTime;
  }

  Dynamics& dynamics;
  const int n;
  Vector base, moved, y, y_new, error, inside;
  boost::numeric::odeint::rosenbrock4<double, Coefficients> method;
  Status status = Status::completed;
  long evaluations = 0;
  bool prepared = false;
};

StiffStep::StiffStep(Dynamics& dynamics) : impl_(std::make_unique<Impl>(dynamics)) {}
StiffStep::~StiffStep() = default;

Status StiffStep::step(double t, double h, const double* y, double* y_new, double* error) {
  Impl& s = *impl_;
  std::copy(y, y + s.n, s.y.begin());
  s.status = Status::completed;
  s.prepared = false;
  auto rate = [&s](const Vector& x, Vector& dxdt, double time) { s.rate(x, dxdt, time); };
  auto jacobian = [&s](const Vector& x, Matrix& J, double time, Vector& dfdt) { s.jacobian(x, J, time, dfdt); };
  s.method.do_step(std::make_pair(std::ref(rate), std::ref(jacobian)), s.y, t, s.y_new, h, s.error);
  std::copy(s.y_new.begin(), s.y_new.end(), y_new);
  std::copy(s.error.begin(), s.error.end(), error);
  return s.status;
}

void StiffStep::interpolate(double fraction, const double* y_old, const double* y_new, double* out) {
  Impl& s = *impl_;
  if (!s.prepared) s.method.prepare_dense_output();
  s.prepared = true;
  std::copy(y_old, y_old + s.n, s.y.begin());
  std::copy(y_new, y_new + s.n, s.y_new.begin());
  s.method.calc_state(fraction, s.inside, s.y, 0.0, s.y_new, 1.0);
  std::copy(s.inside.begin(), s.inside.end(), out);
}

long StiffStep::take_evaluations() {
  const long count = impl_->evaluations;
  impl_->evaluations = 0;
  return count;
}

}  // namespace drillrig
