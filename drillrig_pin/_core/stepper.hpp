// Runge-Kutta and Rosenbrock steps, with error control and an interpolant over the last step.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "dynamics.hpp"
#include "rollout.hpp"
#include "stiff.hpp"

namespace drillrig {

class Stepper {
 public:
  Stepper(Dynamics& dynamics, const RunSettings& settings);

  // Start afresh at (t, y): evaluates f there and, if adaptive, chooses a first step.
  Status start(double t, const double* y, double bound, double first = 0.0);
  // One accepted step that does not pass `bound`.
  Status advance(double bound);
  // State at a time within the last step.
  void interpolate(double t, double* y);

  double t = 0.0, t_old = 0.0;
  Eigen::VectorXd y, y_old, f;
  long evaluations = 0;

 private:
  Status evaluate(double t, const Eigen::VectorXd& y, double* out);
  Status rk4(double bound);
  Status dop853(double bound);
  Status rodas(double bound);
  double shortest() const;
  double longest() const;
  double first_step(double bound);
  void prepare_interpolant();

  Dynamics& dynamics_;
  const RunSettings& settings_;
  const Method method_;
  const int n_;
  double h_ = 0.0, h_used_ = 0.0;
  bool interpolant_ready_ = false;
  std::unique_ptr<StiffStep> stiff_;
  Eigen::MatrixXd K_;  // stages by columns
  Eigen::MatrixXd D_;  // interpolant
  Eigen::VectorXd y_new_, stage_, scale_, f_old_, sum_;
};

}  // namespace drillrig
