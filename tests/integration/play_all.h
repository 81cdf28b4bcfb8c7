// Plays scenarios side by side: they mostly wait.
#pragma once

#include <future>
#include <map>
#include <semaphore>
#include <string>
#include <vector>

#include "fault_scenario.h"

namespace trammel::test {

/// Runs at most `width` at a time.
class SideBySide {
 public:
  static constexpr int kMax = 16;
  explicit SideBySide(int width) : free_(width) {}

  void Start(const Scenario& scenario) {
    outcomes_[scenario.name] = std::async(std::launch::async, [this, scenario] {
                                 free_.acquire();
                                 Outcome outcome = Play(scenario);
                                 free_.release();
                                 return outcome;
                               }).share();
  }
  /// Waits for its end. REQUIRES that it was started.
  [[nodiscard]] const Outcome& Of(const std::string& name) { return outcomes_.at(name).get(); }

 private:
  std::counting_semaphore<kMax> free_;
  std::map<std::string, std::shared_future<Outcome>> outcomes_;
};

}  // namespace trammel::test
