#include "tap/ensemble/advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "tap/samples/lines_test_support.h"

namespace trammel::tap {
namespace {

using test_support::TapDrawing;
using ::testing::HasSubstr;

constexpr double kWanted_mm = 0.001;

struct Drawn {
  std::vector<RecordedTap> taps;
  std::vector<TapAnalysis> analyses;

  [[nodiscard]] TapAdvice Advised(const Ensemble& ensemble = {}) const {
    std::vector<AdvisedTap> advised;
    for (std::size_t i = 0; i < taps.size(); ++i) advised.push_back({taps[i].View(), &analyses[i]});
    return Advise(advised, ensemble, kWanted_mm);
  }
  /// Standard uncertainties of the good ones.
  [[nodiscard]] std::vector<double> Stated() const {
    std::vector<double> stated_mm;
    for (const TapAnalysis& analysis : analyses) {
      if (analysis.verdict == Verdict::kGood)
        stated_mm.push_back(analysis.contact_mm.standard_uncertainty);
    }
    return stated_mm;
  }
};

Drawn Draw(const TapDrawing& drawing, int count, std::uint64_t seed) {
  Drawn drawn;
  TapAnalyser analyser({});
  for (int i = 0; i < count; ++i) {
    drawn.taps.push_back(Record(drawing, seed + static_cast<std::uint64_t>(i)));
    drawn.analyses.push_back(analyser.Analyse(drawn.taps.back().View()));
  }
  return drawn;
}

const Advice& Find(const TapAdvice& advice, const char* setting) {
  const auto found = std::find_if(advice.settings.begin(), advice.settings.end(),
                                  [setting](const Advice& one) { return one.setting == setting; });
  if (found == advice.settings.end()) throw std::runtime_error(setting + (": " + advice.none));
  return *found;
}

TEST(TapAdvice, KeepsWhatIsGoodAndReadsItsTraits) {
  const TapAdvice advice = Draw({.drift_g_s = 2}, 10, 1).Advised();
  for (const Advice& one : advice.settings) EXPECT_FALSE(one.change) << one.setting;
  EXPECT_NEAR(advice.traits.Stiffness(), 3500, 350);
  EXPECT_NEAR(advice.traits.press_depth_mm, 0.045, 0.002);
  EXPECT_NEAR(advice.traits.noise_g, 2, 0.2);
  EXPECT_NEAR(advice.traits.approach_noise_g, 2, 0.3);
  const Advice& filter = Find(advice, "drift filter");
  EXPECT_GT(filter.advised, 0.005);
  EXPECT_LT(filter.advised, 0.7);  // 2 * 0.05 / 22 ms / 2 pi
  EXPECT_EQ(Find(advice, "taps per point").advised, 1);
}

TEST(TapAdvice, MendsWhatMissesTheWantedUncertainty) {
  const TapAdvice fast = Draw({.noise_g = 8, .pull_back_mm_s = 1}, 10, 2).Advised();
  EXPECT_LT(Find(fast, "pull-back speed").advised, 0.5);
  const TapAdvice brief = Draw({.pull_back_mm = 0.09}, 10, 3).Advised();
  EXPECT_NEAR(Find(brief, "pull-back distance").advised, 4 * 0.045, 0.011);
  const TapAdvice shallow =
      Draw({.noise_g = 1, .depth_mm = 0.014, .pull_back_mm = 0.1}, 10, 4).Advised();
  EXPECT_NEAR(Find(shallow, "press force").advised, 3500 * 0.0215, 10);
  EXPECT_THAT(Find(shallow, "press force").because, HasSubstr("set the trigger force +"));
}

TEST(TapAdvice, CountsTheMachinesOwnScatterIntoTheTapsPerPoint) {
  Ensemble ensemble;
  ensemble.used = 20;
  ensemble.places.resize(1);
  ensemble.predicted_deviation_mm = 0.0005;
  ensemble.standard_deviation_mm = 0.0024;
  EXPECT_EQ(Find(Draw({}, 10, 5).Advised(ensemble), "taps per point").advised, 6);
}

TEST(TapAdvice, SaysWhyThereIsNone) {
  EXPECT_THAT(Drawn{}.Advised().none, HasSubstr("no taps"));
  EXPECT_THAT(Draw({.no_contact = true}, 4, 6).Advised().none, HasSubstr("0 of 4 taps are good. "));
  Drawn mixed = Draw({}, 3, 7);
  const Drawn slow = Draw({.pull_back_mm_s = 0.2}, 3, 8);
  mixed.taps.insert(mixed.taps.end(), slow.taps.begin(), slow.taps.end());
  mixed.analyses.insert(mixed.analyses.end(), slow.analyses.begin(), slow.analyses.end());
  EXPECT_THAT(mixed.Advised().none, HasSubstr("pull-back speeds from 0.2 to 0.32 mm/s"));
}

TEST(TapAdvice, TapsUnderItAreGoodAndAsCertainAsWanted) {
  constexpr int kFollowed = 100;
  constexpr double kMaxOver = 1.25;  // medians of 100 uncertainties, of a press read through noise
  int changed = 0;
  std::size_t good = 0;
  for (std::uint64_t seed = 3000; seed < 3040; ++seed) {
    Random random(seed);
    const auto log_uniform = [&](double lo, double hi) {
      return lo * std::pow(hi / lo, random.Uniform());
    };
    TapDrawing drawing;
    drawing.rate_hz = log_uniform(80, 2000);
    drawing.noise_g = log_uniform(0.1, 8);
    drawing.stiffness_g_mm = log_uniform(1500, 9000);
    drawing.depth_mm = random.Uniform(80, 250) / drawing.stiffness_g_mm;
    drawing.pull_back_mm_s = log_uniform(0.1, 1);
    drawing.pull_back_mm = drawing.depth_mm * random.Uniform(2, 7);
    drawing.drift_g_s = random.Uniform(-5, 5);
    const Drawn present = Draw(drawing, 10, 1000 * seed);
    const TapAdvice advice = present.Advised();
    if (std::none_of(advice.settings.begin(), advice.settings.end(),
                     [](const Advice& one) { return one.change; })) {
      continue;
    }
    ++changed;
    drawing.depth_mm *= Find(advice, "press force").advised / Find(advice, "press force").present;
    drawing.pull_back_mm = Find(advice, "pull-back distance").advised;
    drawing.pull_back_mm_s = Find(advice, "pull-back speed").advised;
    const Drawn followed = Draw(drawing, kFollowed, 1000 * seed + 100);
    const std::vector<double> stated_mm = followed.Stated();
    good += stated_mm.size();
    ASSERT_FALSE(stated_mm.empty()) << seed;
    EXPECT_LT(Median(stated_mm), kMaxOver * std::max(kWanted_mm, Median(present.Stated()))) << seed;
  }
  EXPECT_GE(changed, 10);
  EXPECT_GE(good, 0.95 * kFollowed * changed);
}

}  // namespace
}  // namespace trammel::tap
