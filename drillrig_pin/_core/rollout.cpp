#include "rollout.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "constraint_watch.hpp"
#include "rows.hpp"
#include "stepper.hpp"

namespace drillrig {

namespace {

constexpr double kLooks[] = {0.25, 0.5, 0.75, 1.0};
constexpr double kSwitchTime = 1e-13;

// Remembers the signs of the switching functions and finds where one changes.
class Watch {
 public:
  Watch(Dynamics& dynamics, const double* y) : dynamics_(dynamics), count_(dynamics.switch_count()) {
    values_.resize(count_);
    signs_.resize(count_);
    next_.resize(count_);
    now_.resize(count_);
    state_.resize(dynamics.size());
    if (count_ > 0) {
      failed_ = !dynamics_.switch_values(y, values_.data());
      for (int i = 0; i < count_; ++i) next_[i] = signs_[i] = values_[i] > 0.0;
    }
  }
  bool active() const { return count_ > 0; }
  bool failed() const { return failed_; }  // a callback did

  // Time just behind the first change of sign within the last step; negative: none.
  double crossed(Stepper& stepper) {
    double left = stepper.t_old;
    for (const double look : kLooks) {
      const double right = look == 1.0 ? stepper.t : stepper.t_old + look * (stepper.t - stepper.t_old);
      stepper.interpolate(right, state_.data());
      read();
      int first = -1;
      double when = 0.0;
      for (int i = 0; i < count_; ++i) now_[i] = values_[i] > 0.0;
      for (int i = 0; i < count_; ++i) {
        if (now_[i] == signs_[i]) continue;
        const double root = find(stepper, i, left, right);
        if (first < 0 || root < when) {
          first = i;
          when = root;
        }
      }
      if (first >= 0) {
        next_ = signs_;
        next_[first] = now_[first];
        if (stepper.t - when > 4 * kSwitchTime) return std::min(when + 2 * kSwitchTime, stepper.t);
        settle();
        return stepper.t;
      }
      left = right;
    }
    return -1.0;
  }
  void settle() { signs_ = next_; }

 private:
  void read() { failed_ = !dynamics_.switch_values(state_.data(), values_.data()) || failed_; }
  double value(Stepper& stepper, int index, double t) {
    stepper.interpolate(t, state_.data());
    read();
    return values_[index];
  }
  // Bisection: a switch is rare and the interpolant cheap.
  double find(Stepper& stepper, int index, double left, double right) {
    const double at_left = value(stepper, index, left);
    if (at_left * value(stepper, index, right) > 0.0) return left;
    while (right - left > kSwitchTime) {
      const double middle = 0.5 * (left + right);
      if (middle <= left || middle >= right) break;
      (at_left * value(stepper, index, middle) > 0.0 ? left : right) = middle;
    }
    return right;
  }

  Dynamics& dynamics_;
  const int count_;
  bool failed_ = false;
  std::vector<double> values_, state_;
  std::vector<char> signs_, next_, now_;
};

}  // namespace

RunReport run(Dynamics& dynamics, const double* y0, const RunSettings& settings, const RunOutput& output,
              int points, Heartbeat heartbeat, void* owner) {
  RunReport report;
  Stepper stepper(dynamics, settings);
  Watch watch(dynamics, y0);
  // A right-hand side of many dofs takes as long as a look at the clock does not matter beside.
  Pulse pulse(heartbeat, owner, dynamics.nv > 30 ? 1 : 64);
  dynamics.listen(&pulse);
  Rows rows(dynamics, settings, output, points, watch.active(), report);
  Eigen::VectorXd restart = Eigen::VectorXd::Zero(dynamics.size());
  const bool projection = settings.projection && dynamics.projects();
  const auto& times = settings.times;
  auto finish = [&](Status status) {
    report.status = status;
    report.time = stepper.t;
    report.evaluations = stepper.evaluations;
    dynamics.listen(nullptr);
    report.state.assign(stepper.y.data(), stepper.y.data() + dynamics.size());
    return std::move(report);
  };
  auto next_stop = [&](std::size_t i) {
    while (!settings.stops[i]) ++i;
    return i;
  };
  std::size_t end = next_stop(1);
  Status status = stepper.start(times[0], y0, settings.ends[end]);
  if (status != Status::completed) return finish(status);
  // The choice of a first step evaluates elsewhere; the record wants the start itself.
  if ((status = dynamics.rate(times[0], y0, stepper.f.data())) != Status::completed) return finish(status);
  if (dynamics.out_of_range()) return finish(Status::diverged);
  ConstraintWatch constraints(dynamics, settings.rtol);
  if ((status = constraints.begin(times[0], y0, stepper.f.data())) != Status::completed) return finish(status);
  // Nothing of a step that passes a singular position is kept.
  auto look = [&] {
    const Status seen = constraints.step(stepper);
    if (seen == Status::singular) stepper.t = constraints.time();
    return seen;
  };
  rows.at_stop(times[0], y0);
  for (std::size_t at = 0; at + 1 < times.size(); at = end) {
    end = next_stop(at + 1);
    const double stop = settings.ends[end];
    while (stepper.t < stop) {
      pulse.reach(stepper.t);
      if (pulse.stop()) return finish(Status::interrupted);
      const double t_before = stepper.t;
      if ((status = stepper.advance(stop)) != Status::completed) return finish(status);
      ++report.steps;
      if (watch.active() && (status = stepper.complete()) != Status::completed) return finish(status);
      const double event = watch.active() ? watch.crossed(stepper) : -1.0;
      if (watch.failed()) return finish(Status::callback_failed);
      if (event > 0.0 && event < stepper.t) {
        // Take the step again so that it ends on the switch, and start afresh behind it.
        restart = stepper.y_old;
        if ((status = stepper.start(t_before, restart.data(), event, event - t_before)) != Status::completed)
          return finish(status);
        while (stepper.t < event) {
          if ((status = stepper.advance(event)) != Status::completed) return finish(status);
          if ((status = stepper.settle(false)) != Status::completed) return finish(status);
          ++report.steps;
          if ((status = look()) != Status::completed) return finish(status);
          if ((status = rows.inside(stepper, false)) != Status::completed) return finish(status);
        }
        restart = stepper.y;
        if (projection && (status = dynamics.project(restart.data())) != Status::completed) return finish(status);
        if ((status = stepper.start(event, restart.data(), stop)) != Status::completed) return finish(status);
        watch.settle();
        ++report.switches;
        continue;
      }
      // The exponential steps rest on an unbroken past: they are projected where they are looked at.
      const bool stopped = stepper.t >= stop;
      const bool now = projection && (settings.method != Method::ExpAdams || stopped);
      if ((status = stepper.settle(now)) != Status::completed) return finish(status);
      // The switches have been looked for inside the step.
      if (watch.active() &&
          (status = dynamics.rate(stepper.t, stepper.y.data(), stepper.f.data())) != Status::completed)
        return finish(status);
      if ((status = look()) != Status::completed) return finish(status);
      if (stopped && dynamics.out_of_range()) return finish(Status::diverged);
      if ((status = rows.inside(stepper, stopped)) != Status::completed) return finish(status);
    }
    if (settings.breaks[end] && (status = stepper.pass_break(settings.starts[end])) != Status::completed)
      return finish(status);
    rows.at_stop(times[end], stepper.y.data());
  }
  return finish(Status::completed);
}

}  // namespace drillrig
