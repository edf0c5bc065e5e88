#include "rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace drillrig {

namespace {

void put(double* base, long row, const double* from, int count) {
  if (base != nullptr && count > 0) std::memcpy(base + row * count, from, sizeof(double) * count);
}

}  // namespace

Rows::Rows(Dynamics& dynamics, const RunSettings& settings, const RunOutput& output, int points, bool switching,
           RunReport& report)
    : dynamics_(dynamics),
      settings_(settings),
      output_(output),
      points_(points),
      switching_(switching),
      projection_(settings.projection && dynamics.projects()),
      report_(report),
      aside_settings_(settings) {
  const std::size_t nq = dynamics.nq, nv = dynamics.nv, m = dynamics.m(), n = dynamics.forces();
  width_ = 1 + nq + 2 * nv + 2 + 3 * m + 2 * n + 3 * points + 2;
  y_ = rate_ = Eigen::VectorXd::Zero(dynamics.size());
  const auto stops = std::count_if(settings.stops.begin(), settings.stops.end(), [](unsigned char s) { return s != 0; });
  if (switching || static_cast<std::size_t>(stops) < settings.times.size()) {
    // Each method continues itself but the exponential one, whose steps are no shorter than its past: DOP853 does.
    if (settings.method == Method::ExpAdams) aside_settings_.method = Method::DOP853;
    if (settings.method != Method::DOP853) aside_ = std::make_unique<Stepper>(dynamics, aside_settings_);
  }
  if (!switching) return;
  largest_ = Eigen::VectorXd::Zero(dynamics.forces());
  forces_.assign(kHalvings + 3, largest_);
  for (int i = 0; i < dynamics.forces(); ++i)
    if (!dynamics.is_load(i)) watched_.push_back(i);
  // Address space, not memory: rows are appended without asking for any in most runs.
  report_.extra.reserve(std::min<std::size_t>(width_ * (4 * settings.times.size() + 1000), std::size_t{1} << 25));
}

void Rows::record(const RunOutput& to, long row, double t, const double* y) {
  Dynamics& d = dynamics_;
  if (to.time != nullptr) to.time[row] = t;
  put(to.q, row, y, d.nq);
  put(to.v, row, y + d.nq, d.nv);
  put(to.work, row, y + d.nq + d.nv, 2);
  put(to.a, row, d.a.data(), d.nv);
  put(to.reaction, row, d.lambda.data(), d.m());
  put(to.f, row, d.f.data(), d.m());
  put(to.f_dot, row, d.f_dot.data(), d.m());
  put(to.x, row, d.x.data(), d.forces());
  put(to.F, row, d.F.data(), d.forces());
  if (to.points != nullptr && points_ > 0) d.points(to.points + row * points_ * 3);
  if (to.energy != nullptr) {
    to.energy[2 * row] = d.kinetic_energy(y);
    to.energy[2 * row + 1] = d.potential_energy(y);
  }
}

void Rows::record_extra(double t, const double* y) {
  const std::size_t at = report_.extra.size(), nq = dynamics_.nq, nv = dynamics_.nv, m = dynamics_.m(),
                    n = dynamics_.forces();
  report_.extra.resize(at + width_);
  double* to[12];
  const std::size_t widths[] = {1, nq, nv, nv, 2, m, m, m, n, n, 3 * static_cast<std::size_t>(points_), 2};
  double* place = report_.extra.data() + at;
  for (int i = 0; i < 12; place += widths[i++]) to[i] = place;
  record({to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7], to[8], to[9], to[10], to[11]}, 0, t, y);
}

void Rows::at_stop(double t, const double* y) {
  record(output_, report_.rows++, t, y);
  if (!switching_) return;
  forces_[0] = dynamics_.F;
  largest_ = largest_.cwiseMax(forces_[0].cwiseAbs());
}

Status Rows::inside(Stepper& step, bool stopped) {
  const double near = 1e-9 * (step.t - step.t_old);
  const auto& times = settings_.times;
  auto waits = [&] { return !settings_.stops[report_.rows] && times[report_.rows] <= step.t + near; };
  if (!switching_ && !waits()) return Status::completed;
  aside_from_ = -1.0;
  Status status;
  if (switching_) {
    if (!stopped) {
      if ((status = look(step, step.t)) != Status::completed) return status;
      record_extra(step.t, y_.data());
    }
    forces_[1] = dynamics_.F;
    largest_ = largest_.cwiseMax(forces_[1].cwiseAbs());
  }
  for (; waits(); ++report_.rows) {
    if ((status = look(step, times[report_.rows])) != Status::completed) return status;
    if (dynamics_.out_of_range()) return Status::diverged;
    record(output_, report_.rows, times[report_.rows], y_.data());
  }
  if (switching_) {
    if ((status = refine(step, step.t_old, step.t, 0)) != Status::completed) return status;
    forces_[0] = forces_[1];
  }
  // What comes next finds the dynamics as it would without these rows.
  return dynamics_.rate(step.t, step.y.data(), rate_.data());
}

Status Rows::look(Stepper& step, double t) {
  Status status = state_at(step, t);
  if (status != Status::completed) return status;
  if (projection_ && (status = dynamics_.project(y_.data())) != Status::completed) return status;
  ++step.evaluations;
  return dynamics_.rate(t, y_.data(), rate_.data());
}

Status Rows::state_at(Stepper& step, double t) {
  const double near = 1e-9 * (step.t - step.t_old);
  if (t >= step.t - near) {
    y_ = step.y;
    return Status::completed;
  }
  if (settings_.method == Method::DOP853) {
    step.interpolate(t, y_.data());
    return Status::completed;
  }
  Stepper& aside = *aside_;
  const bool whole = settings_.method == Method::ExpAdams;  // steps over all of it, read by their interpolant
  const double target = whole ? step.t : t;
  Status status = Status::completed;
  if (!whole || aside_from_ != step.t_old || t < aside.t_old) {
    status = aside.start(step.t_old, step.y_old.data(), target, target - step.t_old);
    aside_from_ = step.t_old;
  }
  while (status == Status::completed && aside.t < t - near) {
    status = aside.advance(target);
    if (status == Status::completed) status = aside.settle(false);
  }
  step.evaluations += aside.evaluations;
  aside.evaluations = 0;
  if (status != Status::completed) return status;
  if (whole && aside.t > t + near)
    aside.interpolate(t, y_.data());
  else
    y_ = aside.y;
  return Status::completed;
}

bool Rows::bent(const Eigen::VectorXd& middle, const Eigen::VectorXd& left, const Eigen::VectorXd& right) const {
  for (const int i : watched_)
    if (std::abs(middle[i] - 0.5 * (left[i] + right[i])) > kFlat * largest_[i]) return true;
  return false;
}

// forces_[0] and forces_[1] belong to the ends of the step; the middle at a depth to forces_[2 + depth].
Status Rows::refine(Stepper& step, double left, double right, int depth) {
  // Halves are gone through with their ends in forces_[0] and forces_[1], which are put back behind them.
  const double t = 0.5 * (left + right);
  Status status = look(step, t);
  if (status != Status::completed) return status;
  Eigen::VectorXd& middle = forces_[2 + depth];
  middle = dynamics_.F;
  largest_ = largest_.cwiseMax(middle.cwiseAbs());
  if (!bent(middle, forces_[0], forces_[1])) return Status::completed;
  record_extra(t, y_.data());
  if (depth + 1 >= kHalvings) return Status::completed;
  middle.swap(forces_[1]);  // [1]: the middle; `middle`: the right end
  if ((status = refine(step, left, t, depth + 1)) != Status::completed) return status;
  middle.swap(forces_[1]);
  middle.swap(forces_[0]);  // [0]: the middle; `middle`: the left end
  if ((status = refine(step, t, right, depth + 1)) != Status::completed) return status;
  middle.swap(forces_[0]);
  return Status::completed;
}

}  // namespace drillrig
