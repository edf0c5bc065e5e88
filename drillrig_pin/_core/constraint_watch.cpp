#include "constraint_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drillrig {

namespace {

// The same numbers as in drillrig_pin/constraint_watch.py.
constexpr double kDrift = 1e-3, kStill = 1e-9, kProbe = 1e-6, kCalm = 0.5;
constexpr int kHalvings = 40;

}  // namespace

ConstraintWatch::ConstraintWatch(Dynamics& dynamics, double rtol)
    : dynamics_(dynamics),
      m_(dynamics.m()),
      nv_(dynamics.nv),
      nq_(dynamics.nq),
      rank_(dynamics.rank()),
      ranked_(dynamics.watches_rank() && rank_ > 0),
      threshold_(dynamics.rank_threshold()),
      weak_(std::clamp(10.0 * rtol, 1e-4, 1e-2)) {
  if (!ranked_) return;
  J_.setZero(m_, nv_);
  last_ = looked_ = J_;
  q_ = qdot_ = chord_ = Eigen::VectorXd::Zero(nq_);
  state_.setZero(dynamics.size());
  middle_.assign(kHalvings + 1, J_);
  svd_ = Eigen::JacobiSVD<Eigen::MatrixXd>(m_, nv_);
}

void ConstraintWatch::take(const double* J) {
  J_ = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(J, m_, nv_);
}

double ConstraintWatch::smallest(const Eigen::MatrixXd& J) {
  // A decomposition of what is no number may not come back.
  if (!J.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  svd_.compute(J);
  const double value = svd_.singularValues()[rank_ - 1];
  largest_ = std::max(largest_, svd_.singularValues()[0]);
  reference_ = std::max(reference_, value);
  return value;
}

double ConstraintWatch::limit() const { return std::max(threshold_ * largest_, weak_ * reference_); }

void ConstraintWatch::keep(double t, const double* y, const double* dy) {
  t_ = t;
  q_ = Eigen::Map<const Eigen::VectorXd>(y, nq_);
  qdot_ = Eigen::Map<const Eigen::VectorXd>(dy, nq_);
  last_ = J_;
}

Status ConstraintWatch::begin(double t, const double* y, const double* dy) {
  if (m_ == 0) return Status::completed;
  double size = 0.0;
  for (int i = 0; i < m_ * nv_; ++i) size = std::max(size, std::abs(dynamics_.jacobian()[i]));
  // Rows that nothing can move are off by rounding alone: no scale for what they may be off.
  drift_ = kDrift * (size > kStill ? std::min(1.0, size) : 1.0);
  if (!ranked_) return Status::completed;
  take(dynamics_.jacobian());
  if (!J_.allFinite()) return Status::diverged;
  keep(t, y, dy);
  looked_ = J_;
  value_ = smallest(J_);
  time_ = t;
  if (!(value_ > threshold_ * largest_)) return Status::singular;
  Eigen::VectorXd turn = Eigen::VectorXd::Zero(nv_), aside(nq_), rate(dynamics_.size());
  for (int d = 0; d < nv_; ++d) {
    if (dynamics_.stopped()) return Status::interrupted;
    aside = q_;
    turn.setZero();
    turn[d] = kProbe;
    dynamics_.tree().integrate(aside.data(), turn.data());
    take(dynamics_.jacobian_at(aside.data()));
    slope_ = std::max(slope_, (J_ - last_).norm() / (aside - q_).norm());
  }
  return dynamics_.rate(t, y, rate.data());
}

// How far J may have been from the chord between the ends of a step; true if that and the chord itself leave no doubt.
bool ConstraintWatch::bends_little(double h, const double* y, const double* dy) {
  chord_ = Eigen::Map<const Eigen::VectorXd>(y, nq_) - q_;
  const double way = chord_.norm();
  const double change = (J_ - last_).norm();
  if (way > 1e-9) slope_ = std::max(slope_, change / way);
  chord_ /= h;
  const double slack = (qdot_ - chord_).norm() + (Eigen::Map<const Eigen::VectorXd>(dy, nq_) - chord_).norm();
  bend_ = slope_ * (2.0 * (4.0 / 27.0) * h * slack + 0.5 * way * way);
  const double before = moved_;
  moved_ = (J_ - looked_).norm();
  return std::max(before, moved_) + bend_ < kCalm * value_;
}

Status ConstraintWatch::step(Stepper& stepper) {
  if (m_ == 0) return Status::completed;
  if (!dynamics_.f.allFinite()) return Status::diverged;
  if (!(dynamics_.f.lpNorm<Eigen::Infinity>() <= drift_)) return Status::drifted;
  if (!ranked_) return Status::completed;
  const double h = stepper.t - t_;
  if (!(h > 0.0)) return Status::completed;
  take(dynamics_.jacobian());
  if (!J_.allFinite()) return Status::diverged;
  if (bends_little(h, stepper.y.data(), stepper.f.data())) {
    looked_there_ = false;
    keep(stepper.t, stepper.y.data(), stepper.f.data());
    return Status::completed;
  }
  const double before = looked_there_ ? value_ : smallest(last_);
  const double after = smallest(J_);
  double found = -1.0;
  if (!(0.5 * (before + after - (J_ - last_).norm()) - bend_ > limit())) {
    looked_ = J_;  // J_ is needed for what lies inside
    found = lost(stepper, t_, last_, before, stepper.t, looked_, after, kHalvings);
    J_ = looked_;
    if (dynamics_.stopped()) return Status::interrupted;
    if (found < 0.0 && !(after > limit())) found = stepper.t;
    const Status status = dynamics_.rate(stepper.t, stepper.y.data(), stepper.f.data());
    if (status != Status::completed) return status;
  }
  if (found >= 0.0) {
    time_ = found;
    return Status::singular;
  }
  looked_ = J_;
  value_ = after;
  moved_ = 0.0;
  looked_there_ = true;
  keep(stepper.t, stepper.y.data(), stepper.f.data());
  return Status::completed;
}

// First time between two at which rank is as good as lost; negative: none.
double ConstraintWatch::lost(Stepper& stepper, double left, const Eigen::MatrixXd& J_left, double value_left,
                             double right, const Eigen::MatrixXd& J_right, double value_right, int depth) {
  const double middle = 0.5 * (left + right);
  if (depth == 0 || middle <= left || middle >= right || dynamics_.stopped()) return -1.0;
  Eigen::MatrixXd& J = middle_[depth];
  stepper.interpolate(middle, state_.data());
  take(dynamics_.jacobian_at(state_.data()));
  J = J_;
  J_ -= 0.5 * (J_left + J_right);
  const double off = 2.0 * J_.norm();
  J_ = J_right - J_left;
  const bool clear = 0.5 * (value_left + value_right - J_.norm()) - off > limit();
  if (clear && depth < kHalvings) return -1.0;
  const double value = smallest(J);
  if (!(value > limit())) return middle;
  const double found = lost(stepper, left, J_left, value_left, middle, J, value, depth - 1);
  if (found >= 0.0) return found;
  return lost(stepper, middle, J, value, right, J_right, value_right, depth - 1);
}

}  // namespace drillrig
