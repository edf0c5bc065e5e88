// Asks now and then whether to stop: from every loop that may last, by way of the right-hand side.
#pragma once

#include <chrono>

namespace drillrig {

// Called about twenty times a second with the time reached; true: stop.
using Heartbeat = bool (*)(void* owner, double time);

class Pulse {
 public:
  // `every`: calls between two looks at the clock.
  Pulse(Heartbeat beat, void* owner, unsigned every) : beat_(beat), owner_(owner), every_(every), last_(Clock::now()) {}

  void reach(double t) { reached_ = t; }
  // True from the first time on that the heartbeat said so.
  bool stop() {
    if (stopped_ || beat_ == nullptr || ++count_ < every_) return stopped_;
    count_ = 0;
    const auto now = Clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return false;
    last_ = now;
    return stopped_ = beat_(owner_, reached_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Heartbeat beat_;
  void* owner_;
  unsigned every_, count_ = 0;
  double reached_ = 0.0;
  bool stopped_ = false;
  Clock::time_point last_;
};

}  // namespace drillrig
