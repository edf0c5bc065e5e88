// Runge-Kutta, Rosenbrock and exponential Adams steps, with error control and an interpolant over the last step.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "dynamics.hpp"
#include "exponential.hpp"
#include "rollout.hpp"
#include "stiff.hpp"

namespace drillrig {

class Stepper {
 public:
  Stepper(Dynamics& dynamics, const RunSettings& settings);

  // Start afresh at (t, y): evaluates f there and, if adaptive, chooses a first step.
  Status start(double t, const double* y, double bound, double first = 0.0);
  // One accepted step that does not pass `bound`. Leaves y there; `settle` or `complete` its rate f.
  Status advance(double bound);
  // The rate at y, if the step has not left it.
  Status complete();
  // What must follow a step: y projected if asked, and its rate.
  Status settle(bool projection);
  // Some law goes on otherwise from here: values before it say nothing about those behind it.
  Status pass_break(double next);  // go on at `next`, behind it
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
  Status exponential(double bound);
  Status exponential_start(double bound);
  Status choose_spacing(double bound);
  Status linearise();
  double exponential_error();  // of the motion over the step ahead, over the tolerance
  double work_error() const;   // of the work
  double shortest() const;
  double longest() const;
  Status first_step(double bound);  // into h_
  void prepare_interpolant();

  Dynamics& dynamics_;
  const RunSettings& settings_;
  const Method method_;
  const int n_;
  double h_ = 0.0;
  int troubles_ = 0;
  double node_ = 0.0, wanted_ = 0.0;  // of the exponential steps: time of the newest value, longest spacing wanted
  bool interpolant_ready_ = false, rate_known_ = false, exponential_step_ = false, at_stop_ = true;
  std::unique_ptr<StiffStep> stiff_;
  std::unique_ptr<ExponentialAdams> past_;
  Eigen::MatrixXd K_;  // stages by columns
  Eigen::MatrixXd D_;  // interpolant
  Eigen::VectorXd y_new_, stage_, scale_, f_old_, sum_, error_;
};

}  // namespace drillrig
