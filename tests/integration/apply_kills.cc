#include "apply_kills.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/random.h"
#include "machine_shop.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

using files::Application;
using files::NotedApplication;
using measurement::Instrument;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kSame_s = 1e-6;

bool Same(std::optional<double> a, double b) { return a && std::abs(*a - b) < kSame_s; }

class KilledShop {
 public:
  [[nodiscard]] double InForce() const { return shop_.Look().settings.at("pressure advance"); }
  [[nodiscard]] std::vector<NotedApplication> Noted() const {
    return Must(files::Applications(applied_, Instrument::kPressureAdvance,
                                    [](const std::string&) { return true; }));
  }
  [[nodiscard]] std::vector<std::string> Words(std::vector<std::string> words) const {
    words.insert(words.begin(), {"pa", "apply"});
    words.insert(words.end(), {"--printer", shop_.address()});
    return words;
  }
  [[nodiscard]] ProcessEnd Run(const std::vector<std::string>& words) const {
    return shop_.Run(Words(words));
  }
  /// The folder of a result.
  [[nodiscard]] std::string Keep(double value_s, int number) const {
    const std::string name = fmt::format("r{}", number);
    KeepIn(shop_.folder() / name, FoundPressureAdvance(value_s, number));
    return name;
  }
  /// Results that cannot be read.
  [[nodiscard]] std::size_t Torn() const {
    const auto history = files::ReadHistory(shop_.folder(), {.last = 10'000});
    return history ? history->skipped.size() : 1;
  }
  void Kill(const std::vector<std::string>& words, double after_s) const {
    TrammelProcess process(Words(words), shop_.folder());
    std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
    process.Send(SIGKILL);
    (void)process.Wait();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // sent values take effect
  }

 private:
  MachineShop shop_{WithoutCamera()};
  std::filesystem::path applied_ = shop_.folder() / "state/trammel/applied.jsonl";
};

}  // namespace

measurement::Outcome FoundPressureAdvance(double value_s, int minute) {
  measurement::Outcome outcome;
  outcome.provenance = {Instrument::kPressureAdvance,
                        "trammel",
                        fmt::format("2026-01-02T{:02}:{:02}:00Z", minute / 60, minute % 60),
                        {}};
  outcome.answers = {{"pressure_advance", "s",
                      Measured::Good({value_s, 0.001, {value_s - 0.002, value_s + 0.002}})}};
  return outcome;
}

void KeepIn(const std::filesystem::path& folder, const measurement::Outcome& outcome) {
  std::filesystem::create_directory(folder);
  EXPECT_TRUE(files::KeepOutcome(folder, outcome));
}

KilledApplies KillApplies(int kills, std::uint64_t seed) {
  Random random(seed);
  const KilledShop shop;
  KilledApplies killed;
  const ProcessEnd whole = shop.Run({"0.0300"});
  EXPECT_EQ(whole.exit_code, 0) << whole.standard_error;
  const double run_s = 1.1 * whole.elapsed_s;
  std::vector<double> moments_s;
  for (int i = 0; i < kills; ++i) moments_s.push_back(run_s * (i + random.Uniform()) / kills);
  for (std::size_t i = moments_s.size(); i > 1; --i) {
    std::swap(moments_s[i - 1], moments_s[random.Below(i)]);
  }
  for (int kill = 0; kill < kills; ++kill) {
    SCOPED_TRACE(fmt::format("seed {}, kill {} after {:.3f} s", seed, kill,
                             moments_s[static_cast<std::size_t>(kill)]));
    const double old_s = shop.InForce();
    const bool undo = kill % 3 == 2;
    double new_s = 0.0301 + 0.0001 * kill;
    std::vector<std::string> words = {fmt::format("{:.4f}", new_s)};
    if (kill % 3 == 1) words = {shop.Keep(new_s, kill)};
    if (undo) {  // undoes the latest setting
      EXPECT_EQ(shop.Run(words).exit_code, 0);
      words = {"--undo"};
    }
    const double from_s = undo ? new_s : old_s;
    const double to_s = undo ? old_s : new_s;
    shop.Kill(words, moments_s[static_cast<std::size_t>(kill)]);
    const double now_s = shop.InForce();
    EXPECT_TRUE(Same(now_s, from_s) || Same(now_s, to_s)) << now_s;
    EXPECT_EQ(shop.Torn(), 0u);
    const auto noted = shop.Noted();
    if (noted.empty()) {
      ADD_FAILURE() << "nothing is noted";
      continue;
    }
    const Application& last = noted.back().application;
    const bool open = files::IsUnfinished(last);
    if (Same(now_s, to_s)) {
      EXPECT_TRUE(Same(last.value, new_s)) << "in force, and not noted";
      EXPECT_TRUE(Same(last.before, old_s));
      EXPECT_TRUE(!undo || last.step != Application::Step::kApplied);
    }
    const bool begun =
        Same(last.value, new_s) && (!undo || last.step != Application::Step::kApplied);
    (open ? killed.open : begun ? killed.finished : killed.unnoted) += 1;
    // The next one says what is in force, and settles the note.
    const ProcessEnd next = shop.Run({"0.0290"});
    EXPECT_EQ(next.exit_code, 0) << next.standard_error;
    if (open) {
      EXPECT_THAT(next.standard_error, HasSubstr("ended before it noted what it did"));
      EXPECT_THAT(next.standard_error, HasSubstr(fmt::format("{:.4f} s is in force", now_s)));
    } else {
      EXPECT_THAT(next.standard_error, Not(HasSubstr("ended before it noted")));
    }
    const auto settled = shop.Noted();
    EXPECT_GE(settled.size(), 2u);
    EXPECT_EQ(settled.back().application.step, Application::Step::kApplied);
    EXPECT_TRUE(Same(settled.back().application.before, now_s));
    if (settled.size() < 2) continue;
    EXPECT_FALSE(files::IsUnfinished(settled[settled.size() - 2].application));
  }
  return killed;
}

}  // namespace trammel::test
