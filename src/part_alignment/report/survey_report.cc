#include "part_alignment/report/survey_report.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "base/rejection.h"
#include "base/statistics.h"
#include "document/interval_text.h"
#include "document/json_number.h"
#include "part_alignment/report/answer_page.h"
#include "part_alignment/survey/survey_answer.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::kLensParameters;
using part_alignment::Survey;
using part_alignment::SurveyedBar;
using part_alignment::SurveyedTarget;
using part_alignment::SurveyOutlier;
using part_alignment::SurveyStation;

constexpr const char* kDatum =
    "free network: inner constraints over all targets; origin in their centroid, x along their "
    "largest extent, z along the least one and to the cameras' side; scale from the bars";

Json StationsJson(const Survey& survey) {
  Json stations = Json::array();
  for (const SurveyStation& station : survey.stations) {
    Json entry = {{"picture", station.picture}, {"used", station.used}};
    if (station.used) {
      entry["place_mm"] = List(station.place_mm);
      entry["camera_from_survey"] = Rows(station.camera_from_survey);
      entry["observations"] = station.observations;
      entry["rms_px"] = Number(station.rms_px);
    } else {
      entry["reason"] = station.reason;
    }
    stations.push_back(std::move(entry));
  }
  return stations;
}

Json LensJson(const Survey& survey) {
  Json lens = Json::object();
  for (int i = 0; i < kLensParameters; ++i) {
    lens[part_alignment::kLensParameterNames.at(static_cast<std::size_t>(i))] = {
        {"value", Number(survey.lens[i])}, {"standard_uncertainty", Number(survey.lens_sigma[i])}};
  }
  return lens;
}

Json OutliersJson(const Survey& survey) {
  Json outliers = Json::array();
  for (const SurveyOutlier& outlier : survey.outliers) {
    outliers.push_back(
        {{"picture", outlier.picture},
         {"target", outlier.target},
         {"error_px", Number(outlier.error_px)},
         {"seen_there", outlier.seen_there.empty() ? Json(nullptr) : Json(outlier.seen_there)}});
  }
  return outliers;
}

Json BarsJson(const Survey& survey) {
  Json bars = Json::array();
  for (const SurveyedBar& bar : survey.bars) {
    const bool checked = bar.test.detectable_mm > 0;
    bars.push_back({{"from", bar.bar.from},
                    {"to", bar.bar.to},
                    {"length_mm", Number(bar.bar.length_mm)},
                    {"sigma_mm", Number(bar.bar.sigma_mm)},
                    {"used", bar.test.used},
                    {"misclosure_mm", checked ? Number(bar.test.misclosure_mm) : Json(nullptr)},
                    {"test_sigmas", checked ? Number(bar.test.test) : Json(nullptr)},
                    {"detectable_mm", checked ? Number(bar.test.detectable_mm) : Json(nullptr)}});
  }
  return bars;
}

Json PlainJson(const Survey& survey) {
  Json left_over = Json::array();
  for (const auto& left : survey.plain.left_over) {
    left_over.push_back(
        {{"reason", left.reason}, {"points", left.points}, {"pictures", left.pictures}});
  }
  return {{"refused", survey.plain.refused},
          {"reason", survey.plain.reason},
          {"targets", survey.plain.targets},
          {"points", survey.plain.points},
          {"used", survey.plain.used},
          {"variance_root",
           survey.plain.targets > 0 ? Number(survey.plain.variance_root) : Json(nullptr)},
          {"left_over", std::move(left_over)}};
}

// Formats the results of the plain points as lines of text.
std::vector<std::string> PlainText(const Survey& survey) {
  const part_alignment::PlainSummary& plain = survey.plain;
  if (plain.points == 0) return {};
  if (plain.refused) return {fmt::format("no plain target is given: {}", plain.reason)};
  std::vector<double> rays;
  int three = 0;
  double worst_mm = 0;
  for (const SurveyedTarget& target : survey.targets) {
    if (!target.plain) continue;
    rays.push_back(target.observations);
    if (target.observations == 3) ++three;
    worst_mm = std::max(worst_mm, target.sigma_mm.maxCoeff());
  }
  std::vector<std::string> words;
  if (rays.empty()) {
    words.push_back(fmt::format("no plain target among {} points", plain.points));
  } else {
    words.push_back(fmt::format(
        "{} plain targets of {} of {} points, by {:.0f} rays in the middle, each coordinate within "
        "{:.3f} mm (95 %){}",
        plain.targets, plain.used, plain.points, Median(rays), kNormal95 * worst_mm,
        three > 0 ? fmt::format("; {} by three rays only, which check little", three) : ""));
  }
  for (const auto& left : plain.left_over) {
    words.push_back(
        fmt::format("{} points in {} pictures {}", left.points, left.pictures, left.reason));
  }
  return words;
}

// Returns the root of the mean variance of a target's coordinates.
double SigmaOf(const SurveyedTarget& target) { return target.sigma_mm.norm() / std::sqrt(3.0); }

std::string OutlierText(const SurveyOutlier& outlier) {
  return fmt::format(
      "target {} in {} is {:.2f} px from where the others put it{}, and was left out",
      outlier.target, outlier.picture, outlier.error_px,
      outlier.seen_there.empty() ? ""
                                 : fmt::format(", at the place of target {}", outlier.seen_there));
}

std::string BarText(const SurveyedBar& bar) {
  const std::string name =
      fmt::format("{}-{}: {:.4f} mm", bar.bar.from, bar.bar.to, bar.bar.length_mm);
  const part_alignment::BarTest& test = bar.test;
  if (test.detectable_mm == 0) return name + (test.used ? ", unchecked" : "; not used");
  return name + fmt::format(
                    ", {:+.4f} mm by the other bars ({:.1f} sigmas); errors are detected "
                    "from {:.3f} mm{}",
                    test.misclosure_mm, std::abs(test.test), test.detectable_mm,
                    test.used ? "" : "; not used");
}

std::vector<std::string> Advice(const Survey& survey) {
  return survey.verdict == Verdict::kGood ? part_alignment::AdvisePictures(survey)
                                          : std::vector<std::string>{};
}

std::size_t UsedStations(const Survey& survey) {
  return static_cast<std::size_t>(std::count_if(survey.stations.begin(), survey.stations.end(),
                                                [](const auto& station) { return station.used; }));
}

}  // namespace

std::string ToJson(const Survey& survey) {
  const bool good = survey.verdict == Verdict::kGood;
  Json targets = Json::array();
  Json precision = Json::array();
  Json plain_targets = Json::array();
  Eigen::Index coded = 0;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    const SurveyedTarget& target = survey.targets[i];
    const auto row = 3 * static_cast<Eigen::Index>(i);
    if (target.plain) {
      plain_targets.push_back({{"id", target.id},
                               {"at_mm", List(target.at_mm)},
                               {"covariance_mm2", Rows(survey.covariance.block<3, 3>(row, row))}});
    } else {
      targets.push_back({{"id", target.id}, {"ideal_mm", List(target.at_mm)}});
      coded += 3;
    }
    precision.push_back({{"id", target.id},
                         {"standard_uncertainty_mm", List(target.sigma_mm)},
                         {"observations", target.observations},
                         {"widest_angle_rad", Number(target.widest_angle_rad)},
                         {"rms_px", Number(target.rms_px)},
                         {"least_redundancy", Number(target.min_redundancy)}});
  }
  Json bar_ends = Json::array();
  for (const SurveyedBar& bar : survey.bars) {
    bar_ends.push_back(bar.bar.from);
    bar_ends.push_back(bar.bar.to);
  }
  return JsonText({{"format", 1},
                   {"verdict", ToString(survey.verdict)},
                   {"reason", survey.reason},
                   {"unchecked", survey.unchecked},
                   {"check", CheckJson(survey.check)},
                   {"datum", kDatum},
                   {"targets", good ? targets : Json(nullptr)},
                   {"targets_covariance_mm2",
                    good ? Rows(survey.covariance.topLeftCorner(coded, coded)) : Json(nullptr)},
                   {"plain_targets", good ? plain_targets : Json(nullptr)},
                   {"plain", PlainJson(survey)},
                   {"bar_ends", std::move(bar_ends)},
                   {"precision", good ? precision : Json(nullptr)},
                   {"lens", good ? LensJson(survey) : Json(nullptr)},
                   {"variance_root", good ? Number(survey.variance_root) : Json(nullptr)},
                   {"stations", StationsJson(survey)},
                   {"outliers", OutliersJson(survey)},
                   {"scale_bars", BarsJson(survey)},
                   {"advice", Advice(survey)},
                   {"notices", survey.notices}});
}

std::string SurveyText(const Survey& survey) {
  std::string text =
      VerdictLine(survey.verdict, survey.reason) + Lines("unchecked", survey.unchecked);
  text += fmt::format("check     {}\n", CheckText(survey.check));
  if (survey.verdict == Verdict::kGood) {
    text += fmt::format(
        "pictures  {} of {}; centres scatter by {:.2f} of what was stated of them\n"
        "datum     {}\n"
        "lens      focal length {}\n",
        UsedStations(survey), survey.stations.size(), survey.variance_root, kDatum,
        WithInterval(survey.lens[part_alignment::kFocal],
                     NormalInterval95(survey.lens[part_alignment::kFocal],
                                      survey.lens_sigma[part_alignment::kFocal]),
                     {.unit = "px"}));
  }
  for (const SurveyedBar& bar : survey.bars) {
    text += fmt::format("bar       {}\n", BarText(bar));
  }
  for (const SurveyedTarget& target : survey.targets) {
    if (survey.verdict != Verdict::kGood) break;
    const Eigen::Vector3d half = kNormal95 * target.sigma_mm;
    text += fmt::format("target    {:<8} {:>11.4f} {:>11.4f} {:>11.4f} mm ({}), {} observations\n",
                        target.id, target.at_mm.x(), target.at_mm.y(), target.at_mm.z(),
                        WithinText({half.data(), 3}, kMillimetres), target.observations);
  }
  if (survey.verdict == Verdict::kGood) text += Lines("plain", PlainText(survey));
  for (const SurveyOutlier& outlier : survey.outliers) {
    text += fmt::format("notice    {}\n", OutlierText(outlier));
  }
  return text + Lines("notice", survey.notices) + Lines("next", Advice(survey));
}

std::string SurveyPoints(const Survey& survey, const std::string& surface) {
  std::string text = "id,x_mm,y_mm,z_mm,sigma_mm,surface\n";
  for (const SurveyedTarget& target : survey.targets) {
    text += fmt::format("{},{:.6f},{:.6f},{:.6f},{:.6f},{}\n", target.id, target.at_mm.x(),
                        target.at_mm.y(), target.at_mm.z(), SigmaOf(target),
                        target.plain ? surface : "");
  }
  return text;
}

std::string SurveyPage(const std::string& date, const Survey& survey) {
  const bool good = survey.verdict == Verdict::kGood;
  double worst_mm = 0;
  for (const SurveyedTarget& target : survey.targets) {
    worst_mm = std::max(worst_mm, target.sigma_mm.maxCoeff());
  }
  AnswerPage page;
  page.title = "Survey of " + date;
  page.verdict = survey.verdict;
  page.value = good ? fmt::format("{} targets", survey.targets.size()) : "No coordinates";
  if (good)
    page.detail = fmt::format("each coordinate within {:.3f} mm, 95 %", kNormal95 * worst_mm);
  page.reason = survey.reason;
  page.unchecked = survey.unchecked;
  page.next = good ? "Name the file of --out as targets of the observations, or fit the ideal part "
                     "to the points of --points."
                   : "Put right what the reason above names and photograph anew. No targets were "
                     "written.";
  for (const std::string& line : Advice(survey)) page.next += " " + line + ".";
  page.notices = survey.notices;
  page.text = SurveyText(survey);
  return AnswerPageHtml(page, {});
}

}  // namespace trammel::report
