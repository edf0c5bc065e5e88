#include "stepper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dop853_tableau.hpp"

namespace drillrig {

namespace {
constexpr double kSafety = 0.9, kMinFactor = 0.2, kMaxFactor = 10.0, kExponent = -1.0 / 8.0;
}

Stepper::Stepper(Dynamics& dynamics, const RunSettings& settings)
    : dynamics_(dynamics), settings_(settings), method_(settings.method), n_(dynamics.size()) {
  y = y_old = f = y_new_ = stage_ = scale_ = f_old_ = sum_ = error_ = Eigen::VectorXd::Zero(n_);
  K_.setZero(n_, dop853::kExtended);
  D_.setZero(n_, 7);
  if (method_ == Method::ExpAdams) past_ = std::make_unique<ExponentialAdams>(dynamics);
  if (method_ == Method::RODAS) stiff_ = std::make_unique<StiffStep>(dynamics);
}

Status Stepper::evaluate(double time, const Eigen::VectorXd& state, double* out) {
  ++evaluations;
  return dynamics_.rate(time, state.data(), out);
}

Status Stepper::start(double time, const double* state, double bound, double first) {
  t = t_old = time;
  y = Eigen::Map<const Eigen::VectorXd>(state, n_);
  const Status status = evaluate(t, y, f.data());
  if (status != Status::completed) return status;
  rate_known_ = true;
  if (past_) past_->forget();
  if (method_ != Method::RK4) {
    if (!(first > 0.0)) return first_step(bound);
    h_ = std::min(first, bound - t);
  }
  return Status::completed;
}

// Hairer, Norsett, Wanner, section II.4: from the size of y, f and the change of f over a small Euler step.
Status Stepper::first_step(double bound) {
  const double interval = bound - t;
  h_ = 0.0;
  if (interval <= 0.0) return Status::completed;
  const Eigen::Map<const Eigen::VectorXd> atol(settings_.atol.data(), n_);
  const Eigen::Map<const Eigen::VectorXd> relative(settings_.relative.data(), n_);
  scale_ = atol + y.cwiseAbs().cwiseProduct(relative);
  const double root = std::sqrt(static_cast<double>(n_));
  const double d0 = y.cwiseQuotient(scale_).norm() / root, d1 = f.cwiseQuotient(scale_).norm() / root;
  double h0 = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1;
  h0 = std::min(h0, interval);
  stage_ = y + h0 * f;
  const Status status = evaluate(t + h0, stage_, K_.col(1).data());
  if (status != Status::completed) return status;
  const double d2 = (K_.col(1) - f).cwiseQuotient(scale_).norm() / root / h0;
  const double larger = std::max(d1, d2);
  const double h1 = larger <= 1e-15 ? std::max(1e-6, h0 * 1e-3) : std::pow(0.01 / larger, 1.0 / 8.0);
  h_ = std::min({100.0 * h0, h1, interval, longest()});
  return Status::completed;
}

double Stepper::shortest() const {
  return 10.0 * std::abs(std::nextafter(t, std::numeric_limits<double>::infinity()) - t);
}

double Stepper::longest() const {
  return settings_.max_step > 0.0 ? settings_.max_step : std::numeric_limits<double>::infinity();
}

Status Stepper::advance(double bound) {
  interpolant_ready_ = rate_known_ = exponential_step_ = false;
  const Status status = method_ == Method::RK4      ? rk4(bound)
                        : method_ == Method::DOP853 ? dop853(bound)
                        : method_ == Method::RODAS  ? rodas(bound)
                                                    : exponential(bound);
  if (status == Status::completed && !y.allFinite()) {
    y = y_old;  // the last sound state tells where it went wrong
    return Status::diverged;
  }
  return status;
}

Status Stepper::complete() {
  if (rate_known_) return Status::completed;
  const Status status = evaluate(t, y, f.data());
  rate_known_ = true;
  if (exponential_step_) past_->work(y_old.data(), f.data(), y.data());
  return status;
}

Status Stepper::settle(bool projection) {
  if (projection) {
    const Status status = dynamics_.project(y.data());
    if (status != Status::completed) return status;
    rate_known_ = false;
  }
  return complete();
}

// Behind a jump of a force only the rate is another: the length of the last step is tried on.
Status Stepper::pass_break(double next) {
  if (past_) past_->forget();
  if (next <= t) return Status::completed;
  t = t_old = next;
  rate_known_ = true;
  interpolant_ready_ = false;
  return evaluate(t, y, f.data());
}

Status Stepper::rk4(double bound) {
  const double rest = bound - t;
  const double h = rest > 0.0 ? rest / std::ceil(rest / settings_.step - 1e-9) : rest;
  Status status;
  stage_ = y + (h / 2) * f;
  if ((status = evaluate(t + h / 2, stage_, K_.col(1).data())) != Status::completed) return status;
  stage_ = y + (h / 2) * K_.col(1);
  if ((status = evaluate(t + h / 2, stage_, K_.col(2).data())) != Status::completed) return status;
  stage_ = y + h * K_.col(2);
  if ((status = evaluate(t + h, stage_, K_.col(3).data())) != Status::completed) return status;
  y_old = y;
  f_old_ = f;
  t_old = t;
  y += (h / 6) * (f_old_ + 2.0 * (K_.col(1) + K_.col(2)) + K_.col(3));
  t = h == rest ? bound : t + h;
  return Status::completed;
}

Status Stepper::dop853(double bound) {
  using namespace drillrig::dop853;
  const Eigen::Map<const Eigen::VectorXd> atol(settings_.atol.data(), n_);
  const Eigen::Map<const Eigen::VectorXd> relative(settings_.relative.data(), n_);
  const double shortest = this->shortest();
  double h_abs = std::max(std::min(h_, longest()), shortest);
  bool rejected = false;
  K_.col(0) = f;
  while (true) {
    if (!(h_abs >= shortest)) return Status::step_too_small;
    double t_new = t + h_abs;
    if (t_new > bound - 1e-9 * h_abs) t_new = bound;  // no sliver of rounding size is left before it
    const double h = t_new - t;
    h_abs = h;
    Status status;
    for (int s = 1; s < kStages; ++s) {
      sum_ = A[s][0] * K_.col(0);
      for (int j = 1; j < s; ++j)
        if (A[s][j] != 0.0) sum_ += A[s][j] * K_.col(j);
      stage_ = y + h * sum_;
      if ((status = evaluate(t + C[s] * h, stage_, K_.col(s).data())) != Status::completed) return status;
    }
    sum_ = B[0] * K_.col(0);
    for (int j = 1; j < kStages; ++j)
      if (B[j] != 0.0) sum_ += B[j] * K_.col(j);
    y_new_ = y + h * sum_;
    if ((status = evaluate(t_new, y_new_, K_.col(kStages).data())) != Status::completed) return status;
    scale_ = atol + y.cwiseAbs().cwiseMax(y_new_.cwiseAbs()).cwiseProduct(relative);
    double e5 = 0.0, e3 = 0.0;
    for (int i = 0; i < n_; ++i) {
      double five = 0.0, three = 0.0;
      for (int j = 0; j <= kStages; ++j) {
        five += K_(i, j) * E5[j];
        three += K_(i, j) * E3[j];
      }
      five /= scale_[i];
      three /= scale_[i];
      e5 += five * five;
      e3 += three * three;
    }
    const double denominator = e5 + 0.01 * e3;
    const double error = e5 == 0.0 && e3 == 0.0 ? 0.0 : h * e5 / std::sqrt(denominator * n_);
    if (error < 1.0) {
      double factor = error == 0.0 ? kMaxFactor : std::min(kMaxFactor, kSafety * std::pow(error, kExponent));
      if (rejected) factor = std::min(1.0, factor);
      h_ = h_abs * factor;
      t_old = t;
      y_old.swap(y);
      y.swap(y_new_);
      f_old_.swap(f);
      f = K_.col(kStages);
      rate_known_ = true;
      t = t_new;
      return Status::completed;
    }
    // A state outside the domain of a law gives an error that is not a number: the step is shortened like any other.
    h_abs *= std::isfinite(error) ? std::max(kMinFactor, kSafety * std::pow(error, kExponent)) : kMinFactor;
    rejected = true;
  }
}

Status Stepper::rodas(double bound) {
  const Eigen::Map<const Eigen::VectorXd> atol(settings_.atol.data(), n_);
  const Eigen::Map<const Eigen::VectorXd> relative(settings_.relative.data(), n_);
  const double shortest = this->shortest();
  double h_abs = std::max(std::min(h_, longest()), shortest);
  bool rejected = false;
  while (true) {
    if (!(h_abs >= shortest)) return Status::step_too_small;
    const double t_new = std::min(t + h_abs, bound), h = t_new - t;
    h_abs = h;
    const Status status = stiff_->step(t, h, y, f, y_new_, sum_);
    evaluations += stiff_->take_evaluations();
    if (status != Status::completed) return status;
    scale_ = atol + y.cwiseAbs().cwiseMax(y_new_.cwiseAbs()).cwiseProduct(relative);
    const double error = sum_.cwiseQuotient(scale_).norm() / std::sqrt(static_cast<double>(n_));
    const double factor = std::isfinite(error) ? kSafety * std::pow(std::max(error, 1e-10), -0.25) : kMinFactor;
    if (error < 1.0) {
      h_ = h_abs * std::min(rejected ? 1.0 : kMaxFactor, factor);
      t_old = t;
      y_old.swap(y);
      y.swap(y_new_);
      t = t_new;
      return Status::completed;
    }
    h_abs *= std::max(kMinFactor, std::min(factor, 1.0));
    rejected = true;
  }
}

void Stepper::prepare_interpolant() {
  using namespace drillrig::dop853;
  const double h = t - t_old;
  for (int s = kStages + 1; s < kExtended; ++s) {
    sum_ = A[s][0] * K_.col(0);
    for (int j = 1; j < s; ++j)
      if (A[s][j] != 0.0) sum_ += A[s][j] * K_.col(j);
    stage_ = y_old + h * sum_;
    evaluate(t_old + C[s] * h, stage_, K_.col(s).data());
  }
  D_.col(0) = y - y_old;
  D_.col(1) = h * K_.col(0) - D_.col(0);
  D_.col(2) = 2.0 * D_.col(0) - h * (K_.col(kStages) + K_.col(0));
  for (int r = 0; r < 4; ++r) {
    sum_.setZero();
    for (int j = 0; j < kExtended; ++j)
      if (D[r][j] != 0.0) sum_ += D[r][j] * K_.col(j);
    D_.col(3 + r) = h * sum_;
  }
  interpolant_ready_ = true;
}

void Stepper::interpolate(double time, double* out) {
  Eigen::Map<Eigen::VectorXd> result(out, n_);
  const double h = t - t_old, s = (time - t_old) / h;
  if (method_ == Method::RK4 || method_ == Method::ExpAdams) {
    const double s2 = s * s, s3 = s2 * s;
    result = (2 * s3 - 3 * s2 + 1) * y_old + (s3 - 2 * s2 + s) * h * f_old_ + (3 * s2 - 2 * s3) * y + (s3 - s2) * h * f;
    return;
  }
  if (method_ == Method::RODAS) return stiff_->interpolate(s, y_old, y, out);
  if (!interpolant_ready_) prepare_interpolant();
  result.setZero();
  for (int r = 6, i = 0; r >= 0; --r, ++i) {
    result += D_.col(r);
    result *= i % 2 == 0 ? s : 1.0 - s;
  }
  result += y_old;
}

}  // namespace drillrig
