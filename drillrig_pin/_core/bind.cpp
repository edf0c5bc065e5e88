// The Python boundary: arrays come checked and allocated, the GIL is released for a whole run, a status goes back.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <stdexcept>

#include "rollout.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace drillrig;

namespace {

using Numbers = std::vector<double>;
using Integers = std::vector<int>;
using Array = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<unsigned char, nb::c_contig, nb::device::cpu>;

std::vector<Anchor> anchors_of(const Numbers& table) {
  std::vector<Anchor> anchors;
  for (std::size_t i = 0; i + 4 < table.size(); i += 5)
    anchors.push_back({static_cast<int>(table[i]), {table[i + 1], table[i + 2], table[i + 3]}, table[i + 4]});
  return anchors;
}

nb::object copy_of(const double* from, std::initializer_list<std::size_t> shape) {
  std::size_t size = 1;
  for (const std::size_t n : shape) size *= n;
  double* memory = new double[size > 0 ? size : 1];
  std::copy(from, from + size, memory);
  nb::capsule owner(memory, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, double>(memory, shape, owner));
}

// What the Python side lends a run: callbacks of laws and a heartbeat. An exception is kept and raised after the run.
struct Borrowed {
  nb::object law, switches, beat;
  std::optional<nb::python_error> error;

  LawCallback callback();

  // Calls Python; false if it raised, or gave something else than asked.
  template <class Call>
  bool call(Call&& body) {
    nb::gil_scoped_acquire gil;
    try {
      body();
      return true;
    } catch (nb::python_error& raised) {
      if (!error) error.emplace(std::move(raised));
    } catch (const std::exception&) {
    }
    return false;
  }
};

bool call_law(void* owner, int index, double x, double x_dot, double t, double* force, double* lost) {
  auto& borrowed = *static_cast<Borrowed*>(owner);
  return borrowed.call([&] {
    std::tie(*force, *lost) = nb::cast<std::tuple<double, double>>(borrowed.law(index, x, x_dot, t));
  });
}

bool call_switches(void* owner, int index, double x, double x_dot, int count, double* out) {
  auto& borrowed = *static_cast<Borrowed*>(owner);
  return borrowed.call([&] {
    const auto values = nb::cast<Numbers>(borrowed.switches(index, x, x_dot));
    if (values.size() != static_cast<std::size_t>(count)) throw std::length_error("switches");
    std::copy(values.begin(), values.end(), out);
  });
}

LawCallback Borrowed::callback() { return {call_law, call_switches, this}; }

bool call_beat(void* owner, double t) {
  auto& borrowed = *static_cast<Borrowed*>(owner);
  return !borrowed.call([&] {
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (!borrowed.beat.is_none()) borrowed.beat(t);
  });
}

RigSpec make_spec(std::shared_ptr<const Tree> tree, const Integers& joints, const Integers& counts, const Integers& gears,
                  const Numbers& ratios, const Numbers& a, const Numbers& b, const Numbers& c, const Integers& base, const Integers& moving, int constraints,
                  const Integers& kinds, const Integers& loads, const Numbers& parameters, const Integers& ranges,
                  Numbers series, Numbers lowest, Numbers highest, Numbers targets, const Integers& support, const Numbers& points, int formulation,
                  int correction, const Numbers& correction_values, int rank, double rank_threshold) {
  RigSpec spec;
  spec.tree = std::move(tree);
  Coordinates& all = spec.coordinates;
  for (std::size_t i = 0; i + 1 < joints.size(); i += 2) all.joints.push_back({joints[i], joints[i + 1]});
  all.turns = counts.at(0), all.lines = counts.at(1), all.slides = counts.at(2), all.angles = counts.at(3);
  for (std::size_t i = 0; i < ratios.size(); ++i)
    all.gears.push_back({{gears.at(4 * i), gears.at(4 * i + 1)}, {gears.at(4 * i + 2), gears.at(4 * i + 3)}, ratios[i]});
  all.a = anchors_of(a), all.b = anchors_of(b), all.c = anchors_of(c);
  all.base = base, all.moving = moving;
  spec.constraints = constraints;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    Law law{static_cast<LawKind>(kinds[i]), loads.at(i) != 0, {}, ranges.at(2 * i), ranges.at(2 * i + 1)};
    for (int k = 0; k < 9; ++k) law.p[k] = parameters.at(9 * i + k);
    spec.laws.push_back(law);
  }
  spec.series = std::move(series);
  spec.lowest = std::move(lowest);
  spec.highest = std::move(highest);
  spec.targets = std::move(targets);
  spec.points = anchors_of(points);
  spec.formulation = static_cast<Formulation>(formulation);
  spec.correction = static_cast<Correction>(correction);
  for (int k = 0; k < 3; ++k) spec.correction_values[k] = correction_values.at(k);
  spec.rank = rank;
  spec.rank_threshold = rank_threshold;
  const int nv = spec.tree->nv();
  spec.spans = spec.tree->spans();
  spec.support.assign(support.begin(), support.end());
  const std::size_t others = all.others();
  const bool sizes_fit = all.a.size() == others && all.b.size() == others && all.c.size() == others &&
                         base.size() == others && moving.size() == others &&
                         spec.support.size() == static_cast<std::size_t>(spec.tree->njoints()) * nv &&
                         spec.laws.size() + constraints == static_cast<std::size_t>(all.size()) &&
                         spec.lowest.size() == spec.laws.size() && spec.highest.size() == spec.laws.size() &&
                         spec.targets.size() == static_cast<std::size_t>(constraints);
  if (!sizes_fit) throw std::invalid_argument("the arrays of a compiled rig do not fit together");
  for (std::size_t i = 0; i < others; ++i)
    for (int d = 0; d < nv; ++d)
      spec.signs.push_back(spec.support[moving[i] * nv + d] - spec.support[base[i] * nv + d]);
  return spec;
}

Numbers all_of(const Array& array) { return {array.data(), array.data() + array.size()}; }
std::vector<unsigned char> all_of(const Flags& array) { return {array.data(), array.data() + array.size()}; }

void require(const Array& array, std::size_t size, const char* what) {
  if (array.size() != size) throw std::invalid_argument(std::string("array of the wrong size: ") + what);
}

nb::dict evaluate_at(const RigSpec& spec, double t, const Array& y, nb::object law) {
  Borrowed borrowed{law, nb::none(), nb::none(), std::nullopt};
  Dynamics d(spec, borrowed.callback());
  require(y, d.size(), "y");
  Numbers dy(d.size());
  const Status status = d.rate(t, y.data(), dy.data());
  if (borrowed.error) throw std::move(*borrowed.error);
  const std::size_t n = d.x.size(), nv = d.nv, m = d.m();
  nb::dict out;
  out["status"] = static_cast<int>(status);
  out["rate"] = copy_of(dy.data(), {dy.size()});
  out["x"] = copy_of(d.x.data(), {n});
  out["x_dot"] = copy_of(d.x_dot.data(), {n});
  out["F"] = copy_of(d.F.data(), {n - m});
  Numbers rows(n * nv), M(nv * nv);
  d.gradient_rows(rows.data());
  for (std::size_t i = 0; i < nv; ++i)
    for (std::size_t j = 0; j <= i; ++j) M[i * nv + j] = M[j * nv + i] = d.tree().M()[i * nv + j];
  out["rows"] = copy_of(rows.data(), {n, nv});
  out["M"] = copy_of(M.data(), {nv, nv});
  out["bias"] = copy_of(d.tree().nle(), {nv});
  out["gamma"] = copy_of(d.gamma.data(), {m});
  out["a"] = copy_of(d.a.data(), {nv});
  out["reaction"] = copy_of(d.lambda.data(), {m});
  return out;
}

// dy/dt by rows at times and states by rows; true if one of them is singular.
bool rates_at(const RigSpec& spec, const Array& times, const Array& states, const Array& rates, nb::object law,
              nb::object beat) {
  Borrowed borrowed{law, nb::none(), beat, std::nullopt};
  Dynamics d(spec, borrowed.callback());
  Pulse pulse(call_beat, &borrowed, 1);
  d.listen(&pulse);
  const std::size_t n = d.size();
  require(states, times.size() * n, "states");
  require(rates, times.size() * n, "rates");
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Status status = d.rate(times.data()[i], states.data() + i * n, rates.data() + i * n);
    if (borrowed.error) throw std::move(*borrowed.error);
    if (status == Status::singular) return true;
  }
  return false;
}

nb::tuple run_case(const RigSpec& spec, const Array& y0, int method, double step, double rtol, const Array& atol,
                   const Array& relative, double max_step, bool projection, const Array& times, const Array& ends,
                   const Array& starts, const Flags& stops, const Flags& breaks, std::vector<std::optional<Array>> arrays,
                   nb::object law, nb::object switches, nb::object beat) {
  Borrowed borrowed{law, switches, beat, std::nullopt};
  Dynamics dynamics(spec, borrowed.callback());
  require(y0, dynamics.size(), "y0");
  const auto size = static_cast<std::size_t>(dynamics.size());
  const std::size_t rows = times.size();
  if (atol.size() != size || relative.size() != size || rows != stops.size() || rows != breaks.size() ||
      rows != ends.size() || rows != starts.size() || rows < 2 || !stops.data()[0] || !stops.data()[rows - 1])
    throw std::invalid_argument("settings of a run do not fit the rig");
  RunSettings settings{static_cast<Method>(method), step, rtol, max_step, projection, all_of(atol), all_of(relative),
                       all_of(times), all_of(ends), all_of(starts), all_of(stops), all_of(breaks)};
  const std::size_t widths[] = {1, static_cast<std::size_t>(dynamics.nq), static_cast<std::size_t>(dynamics.nv),
                                static_cast<std::size_t>(dynamics.nv), 2, static_cast<std::size_t>(dynamics.m()),
                                static_cast<std::size_t>(dynamics.m()), static_cast<std::size_t>(dynamics.m()),
                                static_cast<std::size_t>(dynamics.forces()),
                                static_cast<std::size_t>(dynamics.forces()), 3 * spec.points.size(), 2};
  if (arrays.size() != 12) throw std::invalid_argument("a run fills twelve arrays");
  double* to[12];
  for (int i = 0; i < 12; ++i) {
    to[i] = nullptr;
    if (!arrays[i]) continue;
    require(*arrays[i], rows * widths[i], "output");
    to[i] = arrays[i]->data();
  }
  const RunOutput output{to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7], to[8], to[9], to[10], to[11]};
  RunReport report;
  {
    nb::gil_scoped_release released;
    report = run(dynamics, y0.data(), settings, output, static_cast<int>(spec.points.size()), call_beat, &borrowed);
  }
  // What has been computed is kept; the caller raises the error when it has taken it over.
  nb::object error = borrowed.error ? nb::borrow(borrowed.error->value()) : nb::none();
  return nb::make_tuple(error, static_cast<int>(report.status), report.time, report.rows, report.steps, report.evaluations,
                        report.switches, copy_of(report.state.data(), {report.state.size()}),
                        copy_of(report.extra.data(), {report.extra.size()}));
}

// Nanoseconds per call of the whole right-hand side and of Pinocchio's crba + rnea alone, in turn, in this process.
std::tuple<double, double> time_rate(const RigSpec& spec, double t, const Array& y, int calls) {
  Borrowed borrowed{nb::none(), nb::none(), nb::none(), std::nullopt};
  Dynamics d(spec, borrowed.callback());
  require(y, d.size(), "y");
  Numbers dy(d.size());
  using Clock = std::chrono::steady_clock;
  auto per_call = [&](auto&& body) {
    const auto start = Clock::now();
    for (int i = 0; i < calls; ++i) body();
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count() / calls;
  };
  const double whole = per_call([&] { d.rate(t, y.data(), dy.data()); });
  const double both = per_call([&] { d.tree().crba_and_rnea(y.data(), y.data() + d.nq); });
  return {whole, both};
}

}  // namespace

NB_MODULE(_drillrig, module) {
  module.doc() = "Compiled time loop of drillrig_pin.";
  module.attr("PINOCCHIO_VERSION") = pinocchio_version();
  nb::class_<Tree>(module, "CompiledTree", "A Pinocchio model; immutable, shared by the rigs made of it.")
      .def(nb::init<const std::string&>(), "text"_a);
  nb::class_<RigSpec>(module, "CompiledRig", "A rig bound to its equilibrium; immutable, shared by threads.")
      .def("__init__",
           [](RigSpec* self, std::shared_ptr<Tree> tree, const Integers& joints, const Integers& counts, const Integers& gears,
              const Numbers& ratios, const Numbers& a, const Numbers& b, const Numbers& c, const Integers& base, const Integers& moving, int constraints,
              const Integers& kinds, const Integers& loads, const Numbers& parameters, const Integers& ranges,
              Numbers series, Numbers lowest, Numbers highest, Numbers targets, const Integers& support, const Numbers& points, int formulation,
              int correction, const Numbers& correction_values, int rank, double rank_threshold) {
             new (self) RigSpec(make_spec(std::move(tree), joints, counts, gears, ratios, a, b, c, base, moving, constraints, kinds, loads,
                                          parameters, ranges, std::move(series), std::move(lowest), std::move(highest),
                                          std::move(targets), support, points,
                                          formulation, correction, correction_values, rank, rank_threshold));
           },
           "tree"_a, "joints"_a, "counts"_a, "gears"_a, "ratios"_a, "a"_a, "b"_a, "c"_a, "base"_a, "moving"_a, "constraints"_a, "kinds"_a,
           "loads"_a, "parameters"_a, "ranges"_a, "series"_a, "lowest"_a, "highest"_a, "targets"_a, "support"_a, "points"_a, "formulation"_a,
           "correction"_a, "correction_values"_a, "rank"_a, "rank_threshold"_a)
      .def("evaluate", &evaluate_at, "t"_a, "y"_a, "law"_a = nb::none(),
           "Everything the right-hand side computes at (t, y), by name.")
      .def("rates", &rates_at, "times"_a, "states"_a, "rates"_a, "law"_a = nb::none(), "beat"_a = nb::none(),
           "Right-hand sides at times (k) and states (k, size), into rates (k, size); true if one is singular.")
      .def("run", &run_case, "y0"_a, "method"_a, "step"_a, "rtol"_a, "atol"_a, "relative"_a, "max_step"_a, "projection"_a, "times"_a,
           "ends"_a, "starts"_a, "stops"_a, "breaks"_a, "arrays"_a, "law"_a = nb::none(), "switches"_a = nb::none(),
           "beat"_a = nb::none(),
           "Integrate from times[0] to times[-1]; fills a row of the arrays for each; returns (error, status, time, "
           "rows, steps, evaluations, switches, last state, further rows).")
      .def("time_rate", &time_rate, "t"_a, "y"_a, "calls"_a,
           "Nanoseconds per right-hand side, and per crba + rnea alone.");
}
