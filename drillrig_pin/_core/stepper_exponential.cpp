// The exponential steps of a run: their start, their spacing and when to give them up.
#include <algorithm>
#include <cmath>
#include <limits>

#include "stepper.hpp"

namespace drillrig {

namespace {

constexpr double kSafety = 0.9, kMinFactor = 0.2;
// How often in a row the exponential steps may be found too long before they are given up for good: what they continue
// is not smooth, or rounding is above the tolerance.
constexpr int kTroubles = 8;

// Equal steps to the bound, none longer than wanted.
double divided(double rest, double wanted) { return rest / std::max(1.0, std::ceil(rest / wanted - 1e-6)); }

}  // namespace

Status Stepper::exponential(double bound) {
  ExponentialAdams& past = *past_;
  Status status;
  if (troubles_ > kTroubles) return dop853(bound);
  if (!past.linearised() && (status = linearise()) != Status::completed) return status;
  if (past.empty()) {
    if (wanted_ == 0.0) wanted_ = std::min(longest(), past.guess(settings_.rtol));
    if (!(wanted_ > shortest())) {  // nothing vibrates so fast and can be followed
      troubles_ = kTroubles + 1;
      return dop853(bound);
    }
    past.begin(divided(bound - t, wanted_));
  }
  if (past.begins() || t >= node_ + past.spacing() * (1.0 - 1e-6)) {
    past.push(t, y.data(), f.data());
    node_ = t;
  }
  if (past.ready() && (status = choose_spacing(bound)) != Status::completed) return status;
  if (dynamics_.stopped()) return Status::interrupted;
  if (past.empty()) return dop853(bound);
  if (!past.ready()) return exponential_start(bound);
  const double h = past.spacing();
  y_new_ = y;
  past.step(t, y.data(), y_new_.data(), bound);
  t_old = t;
  y_old.swap(y);
  y.swap(y_new_);
  f_old_ = f;
  at_stop_ = bound - t < 1.5 * h;
  t = at_stop_ ? bound : t + h;
  exponential_step_ = true;
  return Status::completed;
}

Status Stepper::linearise() {
  const Status status = past_->linearise(t, y.data(), f.data());
  evaluations += past_->take_evaluations();
  return status;
}

// The first values come from DOP853, at the distances of the steps to follow.
Status Stepper::exponential_start(double bound) {
  const double spacing = past_->spacing();
  double target = node_ + spacing;
  if (target > bound - 1e-6 * spacing) {
    // A bound at another distance: the past begins anew behind it.
    if (target > bound + 1e-6 * spacing) past_->forget();
    target = bound;
  }
  at_stop_ = target == bound;
  return dop853(target);
}

double Stepper::exponential_error() {
  if (!past_->prepare()) return std::numeric_limits<double>::infinity();
  past_->error(error_);
  const Eigen::Map<const Eigen::VectorXd> atol(settings_.atol.data(), n_);
  const Eigen::Map<const Eigen::VectorXd> relative(settings_.relative.data(), n_);
  scale_ = atol + y.cwiseAbs().cwiseProduct(relative);
  const int n = n_ - 2;
  // With this margin the method errs about as much as DOP853 at the same tolerance, whose estimate is of a lower order.
  constexpr double kMargin = 10.0;
  return kMargin * error_.cwiseQuotient(scale_).head(n).norm() / std::sqrt(static_cast<double>(n));
}

// A linear machine leaves the motion without an error at any spacing, but not the products force times velocity. What is
// missed of them in one step is made good in the next ones: a ten-thousandth of the greatest power keeps the balance of energy
// to much less, 1e-6 and better on a mass that swings far above its resonance. Loose tolerances may miss more.
double Stepper::work_error() const {
  return past_->work_error() / std::max(1e-4, 1e3 * settings_.rtol);
}

// Keeps the spacing if it divides the way to the bound and its error fits the tolerance. Another one begins afresh:
// values interpolated to new distances would carry errors as large as those to be avoided.
Status Stepper::choose_spacing(double bound) {
  constexpr double kRoom = 1e-4;  // twice the spacing has 2^9 times the error
  constexpr long kFresh = 64;
  ExponentialAdams& past = *past_;
  const double exponent = -1.0 / (past.order() + 1);
  const double rest = bound - t, h = past.spacing(), steps = rest / h;
  if (steps > 1.0 - 1e-6 && std::abs(steps - std::round(steps)) < 1e-6) {
    double error = exponential_error();
    if (error > 1.0 && past.age() > kFresh) {
      const Status status = linearise();
      if (status != Status::completed) return status;
      error = exponential_error();
    }
    error = std::max(error, work_error());
    // Longer only behind a stop, so that the spacing divides the ways to others too.
    const double longer = std::min(2.0 * h, longest());
    const bool room = at_stop_ && error < kRoom && past.age() > kFresh && divided(rest, longer) > 1.01 * h;
    if (error <= 1.0 && !room) {
      if (past.age() > kFresh) troubles_ = 0;
      return Status::completed;
    }
    if (room) {
      wanted_ = longer;
    } else {
      if (std::isfinite(error)) wanted_ = h * std::max(kMinFactor, kSafety * std::pow(error, exponent));
      if (++troubles_ > kTroubles) {
        past.forget();
        return Status::completed;
      }
    }
  }
  past.begin(divided(rest, wanted_));
  past.push(t, y.data(), f.data());
  node_ = t;
  return Status::completed;
}

}  // namespace drillrig
