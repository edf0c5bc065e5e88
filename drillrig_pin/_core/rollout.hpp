// One run from start to end, without Python and without allocation in the loop: twin of drillrig_pin/integrators.py.
#pragma once

#include <vector>

#include "dynamics.hpp"

namespace drillrig {

enum class Method : int { RK4, DOP853, RODAS, ExpAdams };

struct RunSettings {
  Method method = Method::DOP853;
  double step = 2.5e-4;  // RK4
  double rtol = 1e-8;
  double max_step = 0.0;  // 0: none
  bool projection = true;
  std::vector<double> atol, relative;  // by component of y; relative: rtol, or 0 where size says nothing
  std::vector<double> times;           // increasing; of the rows
  std::vector<double> ends;            // where the step to each ends: itself, or just before a jump of a force
  std::vector<double> starts;          // where the next one begins: itself, or just behind the jump
  std::vector<unsigned char> stops;    // at which rows a step must end; at the first and the last
  std::vector<unsigned char> breaks;  // behind which of them some law goes on otherwise
};

// Caller-owned arrays, a row per time. Null: not wanted.
struct RunOutput {
  double *time, *q, *v, *a, *work, *reaction, *f, *f_dot, *x, *F, *points, *energy;
};

struct RunReport {
  Status status = Status::completed;
  double time = 0.0;
  long rows = 0, steps = 0, evaluations = 0, switches = 0;
  std::vector<double> state;  // last accepted
  std::vector<double> extra;  // further rows where laws switch, all arrays of a row behind one another
};

RunReport run(Dynamics& dynamics, const double* y0, const RunSettings& settings, const RunOutput& output,
              int points, Heartbeat heartbeat, void* owner);

}  // namespace drillrig
