// Rows of a run: at stops, at times inside steps, and wherever a law that switches needs more of them. Twin of
// drillrig_pin/inside.py.
#pragma once

#include <memory>
#include <vector>

#include "rollout.hpp"
#include "stepper.hpp"

namespace drillrig {

// The sequence of steps does not depend on the times of the rows: what lies inside a step is found from its ends.
class Rows {
 public:
  Rows(Dynamics& dynamics, const RunSettings& settings, const RunOutput& output, int points, bool switching,
       RunReport& report);

  // The row at a stop; the dynamics have just been evaluated there.
  void at_stop(double t, const double* y);
  // All rows before the end of the step just taken, and at its end if that is no stop; the dynamics have been evaluated
  // at its end and are so again afterwards. Status of the first row that failed.
  Status inside(Stepper& step, bool stopped);

 private:
  // Deviation from a straight line, over the largest force so far, that asks for a further row; halvings of a step.
  static constexpr double kFlat = 5e-3;
  static constexpr int kHalvings = 6;

  void record(const RunOutput& to, long row, double t, const double* y);
  void record_extra(double t, const double* y);
  // State at a time inside the step, put back onto the constraints and evaluated.
  Status look(Stepper& step, double t);
  Status state_at(Stepper& step, double t);
  // Halves an interval until the forces of all elements are straight lines between rows.
  Status refine(Stepper& step, double left, double right, int depth);
  bool bent(const Eigen::VectorXd& middle, const Eigen::VectorXd& left, const Eigen::VectorXd& right) const;

  Dynamics& dynamics_;
  const RunSettings& settings_;
  const RunOutput& output_;
  const int points_;
  const bool switching_, projection_;
  RunReport& report_;
  RunSettings aside_settings_;
  std::unique_ptr<Stepper> aside_;  // short steps of its own from where the step began
  double aside_from_ = -1.0;
  Eigen::VectorXd y_, rate_, largest_;
  std::vector<Eigen::VectorXd> forces_;  // at the left end, the right end, and in the middle at every depth
  std::vector<int> watched_;             // elements that are no loads
  std::size_t width_ = 0;
};

}  // namespace drillrig
