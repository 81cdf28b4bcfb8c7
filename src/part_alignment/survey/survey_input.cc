#include "part_alignment/survey/survey_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace trammel::part_alignment {
namespace {

constexpr int kMaxPixels = 100'000;

// Orders numbers before texts, by value.
bool BeforeInOrder(const std::string& a, const std::string& b) {
  const auto key = [](const std::string& id) {
    long long value = 0;
    const auto read = std::from_chars(id.data(), id.data() + id.size(), value);
    const bool number = read.ec == std::errc{} && read.ptr == id.data() + id.size();
    return std::pair(number ? 0 : 1, number ? value : 0LL);
  };
  const auto key_a = key(a);
  const auto key_b = key(b);
  return key_a != key_b ? key_a < key_b : a < b;
}

Result<void> CheckDisc(const SurveyPicture& picture, const ImageEllipse& disc) {
  if (disc.semi_minor_px > 0 && disc.semi_minor_px <= disc.semi_major_px &&
      disc.semi_major_px < kMaxPixels && std::isfinite(disc.angle_rad)) {
    return {};
  }
  return Fail(
      fmt::format("{}: a disc of {} by {} px at {} rad; the first must be the longer, both above 0",
                  picture.name, disc.semi_major_px, disc.semi_minor_px, disc.angle_rad));
}

// Checks that a point is inside. Half a pixel belongs to the first and the last; another program
// may count from their edges.
Result<void> CheckInside(const SurveyPicture& picture, const std::string& what, double column_px,
                         double row_px) {
  if (column_px >= -1 && column_px <= picture.width_px && row_px >= -1 &&
      row_px <= picture.height_px) {
    return {};
  }
  return Fail(
      fmt::format("{}: {} at column {:.1f}, row {:.1f} lies outside of a picture of {} x {} px: "
                  "its image_px is "
                  "another picture's, or columns and rows are exchanged",
                  picture.name, what, column_px, row_px, picture.width_px, picture.height_px));
}

Result<void> CheckPlain(const SurveyPicture& picture) {
  for (const PlainPoint& point : picture.plain) {
    if (!std::isfinite(point.column_px) || !std::isfinite(point.row_px) ||
        !(point.sigma_px > 0 && point.sigma_px < 1e3)) {
      return Fail(fmt::format(
          "{}: a plain point at column {}, row {}, sigma {} px: numbers must be finite, sigma "
          "above 0",
          picture.name, point.column_px, point.row_px, point.sigma_px));
    }
    if (!point.disc) continue;
    TRY(CheckDisc(picture, *point.disc));
  }
  return {};
}

Result<void> CheckPicture(const SurveyPicture& picture) {
  if (picture.width_px < 2 || picture.width_px > kMaxPixels || picture.height_px < 2 ||
      picture.height_px > kMaxPixels) {
    return Fail(fmt::format("{}: {} x {} px; 2 … {} are possible", picture.name, picture.width_px,
                            picture.height_px, kMaxPixels));
  }
  if (!picture.discs.empty() && picture.discs.size() != picture.observations.size()) {
    return Fail(fmt::format("{}: {} discs of {} observations; all of them or none", picture.name,
                            picture.discs.size(), picture.observations.size()));
  }
  for (const ImageEllipse& disc : picture.discs) {
    TRY(CheckDisc(picture, disc));
  }
  TRY(CheckPlain(picture));
  std::set<std::string> ids;
  for (const Observation& observation : picture.observations) {
    if (!std::isfinite(observation.column_px) || !std::isfinite(observation.row_px) ||
        !(observation.sigma_px > 0 && observation.sigma_px < 1e3)) {
      return Fail(
          fmt::format("{}: target {} at column {}, row {}, sigma {} px: numbers must be finite, "
                      "sigma above 0",
                      picture.name, observation.target, observation.column_px, observation.row_px,
                      observation.sigma_px));
    }
    if (!ids.insert(observation.target).second) {
      return Fail(
          fmt::format("{}: target {} stands twice in it", picture.name, observation.target));
    }
  }
  return {};
}

Result<void> CheckBar(const ScaleBar& bar) {
  if (bar.from == bar.to) {
    return Fail(fmt::format("the scale bar from {} to {} has one end", bar.from, bar.to));
  }
  constexpr double kMinShare = 1e-7;       // of the length: 0.1 um per metre, better than any bar
  constexpr double kMaxShare = 1.0 / 200;  // worse than a tape; 10 um of a metre that reads "1 mm"
  if (!(bar.length_mm > 0 && bar.length_mm < 1e6) ||
      !(bar.sigma_mm >= kMinShare * bar.length_mm && bar.sigma_mm <= kMaxShare * bar.length_mm)) {
    return Fail(fmt::format(
        "the scale bar {}-{}: length {} mm, sigma {} mm; both are in mm, the length must be above "
        "0, sigma from 1e-7 to 1/200 of it",
        bar.from, bar.to, bar.length_mm, bar.sigma_mm));
  }
  return {};
}

Result<void> CheckBars(const std::vector<ScaleBar>& bars) {
  std::set<std::pair<std::string, std::string>> ends;
  for (const ScaleBar& bar : bars) {
    TRY(CheckBar(bar));
    if (ends.insert(std::minmax(bar.from, bar.to)).second) continue;
    return Fail(fmt::format(
        "the scale bar {}-{} stands there twice: it would count as two; of a bar that was "
        "calibrated several times give the mean",
        bar.from, bar.to));
  }
  return {};
}

// Checks for copies: a copied picture would count as a second observation.
Result<void> CheckCopies(const std::vector<SurveyPicture>& pictures) {
  using Places = std::vector<std::tuple<std::string, double, double>>;
  std::map<Places, const SurveyPicture*> seen;
  std::vector<std::string> copies;
  for (const SurveyPicture& picture : pictures) {
    if (picture.observations.size() < 2) continue;
    Places places;
    for (const Observation& observation : picture.observations) {
      places.emplace_back(observation.target, observation.column_px, observation.row_px);
    }
    std::sort(places.begin(), places.end());
    const auto [first, is_new] = seen.emplace(std::move(places), &picture);
    if (!is_new) copies.push_back(fmt::format("{} of {}", picture.name, first->second->name));
  }
  if (copies.empty()) return {};
  constexpr std::size_t kMaxNamed = 5;
  std::string words;
  for (std::size_t i = 0; i < std::min(copies.size(), kMaxNamed); ++i) {
    words += (i == 0 ? "" : ", ") + copies[i];
  }
  if (copies.size() > kMaxNamed) words += fmt::format(" and {} more", copies.size() - kMaxNamed);
  return Fail(
      fmt::format("pictures that are copies of others, all targets at the same places: {}; leave "
                  "the copies out",
                  words));
}

}  // namespace

Result<void> CheckSurvey(const SurveyInput& input, const SurveyOptions& options) {
  for (const SurveyPicture& picture : input.pictures) {
    TRY(CheckPicture(picture));
  }
  TRY(CheckCopies(input.pictures));
  TRY(CheckBars(input.bars));
  if (input.focal_length_px && !(*input.focal_length_px > 0 && *input.focal_length_px < 1e6)) {
    return Fail(fmt::format("focal length {} px; above 0 it must be", *input.focal_length_px));
  }
  if (options.min_observations < 3 || !(options.min_angle_rad > 0) ||
      !(options.false_alarm > 0 && options.false_alarm < 1) || !(options.max_variance_root > 0)) {
    return Fail(fmt::format(
        "least_observations {} (3 or more), least_angle_rad {} (above 0), false_alarm {} (0 … 1), "
        "most_variance_root {} (above 0)",
        options.min_observations, options.min_angle_rad, options.false_alarm,
        options.max_variance_root));
  }
  return {};
}

Result<void> CheckPlaces(const SurveyInput& input) {
  for (const SurveyPicture& picture : input.pictures) {
    for (const Observation& at : picture.observations) {
      TRY(CheckInside(picture, "target " + at.target, at.column_px, at.row_px));
    }
    for (const PlainPoint& at : picture.plain) {
      TRY(CheckInside(picture, "a plain point", at.column_px, at.row_px));
    }
  }
  return {};
}

std::optional<std::string> MixedPictures(const SurveyInput& input) {
  for (const SurveyPicture& picture : input.pictures) {
    const SurveyPicture& first = input.pictures.front();
    if (picture.width_px != first.width_px || picture.height_px != first.height_px) {
      return fmt::format("{} has {} x {} px, {} has {} x {} px", first.name, first.width_px,
                         first.height_px, picture.name, picture.width_px, picture.height_px);
    }
  }
  return std::nullopt;
}

IndexedSurvey IndexSurvey(const SurveyInput& input) {
  IndexedSurvey indexed;
  std::set<std::string, decltype(&BeforeInOrder)> ids(&BeforeInOrder);
  for (const SurveyPicture& picture : input.pictures) {
    for (const Observation& observation : picture.observations) ids.insert(observation.target);
  }
  std::map<std::string, std::size_t> index;
  for (const std::string& id : ids) {
    index[id] = indexed.ids.size();
    indexed.ids.push_back(id);
  }
  indexed.coded = indexed.ids.size();
  Network& network = indexed.network;
  network.points.resize(indexed.ids.size());
  network.stations.resize(input.pictures.size());
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    const auto& observations = input.pictures[s].observations;
    for (std::size_t k = 0; k < observations.size(); ++k) {
      network.observations.push_back({s,
                                      index[observations[k].target],
                                      {observations[k].column_px, observations[k].row_px},
                                      observations[k].sigma_px,
                                      true});
      const auto& discs = input.pictures[s].discs;
      indexed.discs.push_back(discs.empty() ? std::nullopt : std::optional(discs[k]));
    }
  }
  for (std::size_t b = 0; b < input.bars.size(); ++b) {
    const ScaleBar& bar = input.bars[b];
    if (!index.contains(bar.from) || !index.contains(bar.to)) continue;
    network.bars.push_back({index[bar.from], index[bar.to], bar.length_mm, bar.sigma_mm, true});
    indexed.bar_of.push_back(b);
  }
  if (!input.pictures.empty()) {
    const SurveyPicture& first = input.pictures.front();
    indexed.longer_side_px = std::max(first.width_px, first.height_px);
    const double focal = input.focal_length_px.value_or(indexed.longer_side_px);
    network.lens = PlainLens(focal, first.width_px, first.height_px);
  }
  return indexed;
}

}  // namespace trammel::part_alignment
