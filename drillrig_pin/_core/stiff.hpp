// One step of RODAS, the Rosenbrock method of order 4(3) that boost::numeric::odeint carries as rosenbrock4, with a
// Jacobian by differences. For systems whose fastest damping, not their motion, would dictate an explicit step.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "dynamics.hpp"

namespace drillrig {

class StiffStep {
 public:
  explicit StiffStep(Dynamics& dynamics);
  ~StiffStep();

  // From (t, y) over h: the new state and its error estimate. Status of the first evaluation that failed.
  Status step(double t, double h, const double* y, double* y_new, double* error);
  // Within the last step; s from 0 to 1 between y_old and y_new.
  void interpolate(double s, const double* y_old, const double* y_new, double* out);
  long take_evaluations();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace drillrig
