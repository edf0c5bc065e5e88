// One step of RODAS, the stiffly accurate Rosenbrock method of order 4(3) of Hairer and Wanner, with a Jacobian by
// differences. For systems whose fastest damping, not their motion, would dictate an explicit step.
//
// Boost's odeint carries the method as rosenbrock4; it asks for memory in every step, and its coefficient d4 has the wrong
// sign (1.90), which takes the order to one under loads that depend on time.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "dynamics.hpp"

namespace drillrig {

class StiffStep {
 public:
  explicit StiffStep(Dynamics& dynamics);

  // From (t, y) with rate f over h: the new state and its error estimate. Status of the first evaluation that failed.
  Status step(double t, double h, const Eigen::VectorXd& y, const Eigen::VectorXd& f, Eigen::VectorXd& y_new,
              Eigen::VectorXd& error);
  // Within the last step; s from 0 to 1 between y_old and y_new.
  void interpolate(double s, const Eigen::VectorXd& y_old, const Eigen::VectorXd& y_new, double* out) const;
  long take_evaluations();

 private:
  static constexpr int kStages = 6;

  Status rate(double t, const Eigen::VectorXd& y, Eigen::VectorXd& out);
  Status linearise(double t, double h, const Eigen::VectorXd& y, const Eigen::VectorXd& f);
  void solve(Eigen::VectorXd& right, int stage);

  Dynamics& dynamics_;
  const int n_;
  long evaluations_ = 0;
  Eigen::MatrixXd W_, stages_;  // 1 / (gamma h) - df/dy; stages by columns
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::VectorXd f_t_, moved_, right_;
};

}  // namespace drillrig
