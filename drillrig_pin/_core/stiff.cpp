#include "stiff.hpp"

#include <algorithm>
#include <cmath>

namespace drillrig {

using Eigen::VectorXd;

namespace {
// Steps of the difference quotients for positions, velocities and time. Oil turns the rounding of a length into noise of
// about 1e-8 m/s^2 in the accelerations, which these steps keep below 1e-6 of the quotient; in velocity the equations are
// all but linear, so that its step may be larger.
constexpr double kPosition = 1e-7, kVelocity = 1e-5, kTime = 1e-7;

// Hairer and Wanner, Solving Ordinary Differential Equations II, section VI.4, code RODAS.
constexpr double kGamma = 0.25;
constexpr double kNode[] = {0.0, 0.386, 0.21, 0.63, 1.0, 1.0};
constexpr double kTimeShare[] = {0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0};
constexpr double kA[][5] = {
    {},
    {1.544},
    {0.9466785280815826, 0.2557011698983284},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0},
};
constexpr double kC[][5] = {
    {},
    {-5.6688},
    {-2.430093356833875, -0.2063599157091915},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054},
};
constexpr double kDense[][5] = {
    {10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662},
    {-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872},
};
}  // namespace

StiffStep::StiffStep(Dynamics& dynamics) : dynamics_(dynamics), n_(dynamics.size()) {
  W_.setZero(n_, n_);
  stages_.setZero(n_, kStages);
  lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(n_);
  f_t_ = moved_ = right_ = VectorXd::Zero(n_);
}

Status StiffStep::rate(double t, const VectorXd& y, VectorXd& out) {
  ++evaluations_;
  return dynamics_.rate(t, y.data(), out.data());
}

// Work done and work dissipated, the last two components, influence nothing: their columns are zero.
Status StiffStep::linearise(double t, double h, const VectorXd& y, const VectorXd& f) {
  Status status;
  W_.setZero();
  moved_ = y;
  for (int k = 0; k < n_ - 2; ++k) {
    const double delta = (k < dynamics_.nq ? kPosition : kVelocity) * std::max(1.0, std::abs(y[k]));
    moved_[k] = y[k] + delta;
    if ((status = rate(t, moved_, right_)) != Status::completed) return status;
    W_.col(k) = (f - right_) / (moved_[k] - y[k]);
    moved_[k] = y[k];
  }
  W_.diagonal().array() += 1.0 / (kGamma * h);
  lu_.compute(W_);
  // Within the step: a force may jump at its end.
  const double ahead = std::min(kTime, h);
  if ((status = rate(t + ahead, y, f_t_)) != Status::completed) return status;
  f_t_ = (f_t_ - f) / ahead;
  return Status::completed;
}

void StiffStep::solve(VectorXd& right, int stage) {
  auto out = stages_.col(stage);
  out.noalias() = lu_.permutationP() * right;
  lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(out);
  lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(out);
}

Status StiffStep::step(double t, double h, const VectorXd& y, const VectorXd& f, VectorXd& y_new, VectorXd& error) {
  Status status = linearise(t, h, y, f);
  if (status != Status::completed) return status;
  right_ = f;
  for (int s = 0; s < kStages; ++s) {
    if (s > 0) {
      y_new = y;
      for (int j = 0; j < s; ++j) y_new += kA[s][j] * stages_.col(j);
      if ((status = rate(t + kNode[s] * h, y_new, right_)) != Status::completed) return status;
    }
    right_ += (h * kTimeShare[s]) * f_t_;
    for (int j = 0; j < s; ++j) right_ += (kC[s][j] / h) * stages_.col(j);
    solve(right_, s);
  }
  error = stages_.col(kStages - 1);
  y_new += error;
  return Status::completed;
}

void StiffStep::interpolate(double s, const VectorXd& y_old, const VectorXd& y_new, double* out) const {
  for (int i = 0; i < n_; ++i) {
    double third = 0.0, fourth = 0.0;
    for (int j = 0; j < 5; ++j) {
      third += kDense[0][j] * stages_(i, j);
      fourth += kDense[1][j] * stages_(i, j);
    }
    out[i] = y_old[i] * (1.0 - s) + s * (y_new[i] + (1.0 - s) * (third + s * fourth));
  }
}

long StiffStep::take_evaluations() {
  const long count = evaluations_;
  evaluations_ = 0;
  return count;
}

}  // namespace drillrig
