#include "part_alignment/procedure/survey_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "machine/page/page_file.h"
#include "part_alignment/targets/ring_finder.h"
#include "part_alignment/targets/target.h"

namespace trammel::procedure {
namespace {

using part_alignment::FoundTarget;
using part_alignment::FoundTargets;
using part_alignment::RejectedTarget;
using part_alignment::RejectReason;
using part_alignment::SurveyPicture;

// Notes rejected targets; skips reasons that scratches and stains cause as well.
void NoteRejected(const FoundTargets& found, const std::string& name,
                  std::vector<std::string>& notices) {
  for (const RejectedTarget& rejected : found.rejected) {
    if (rejected.reason != RejectReason::kDoubled && rejected.reason != RejectReason::kMirrored) {
      continue;
    }
    notices.push_back(fmt::format(
        "{}: what looks like a target{} at column {:.0f}, row {:.0f} was "
        "rejected, because {}",
        name, rejected.number ? fmt::format(" {}", *rejected.number) : "", rejected.column_px,
        rejected.row_px, part_alignment::WordsFor(rejected.reason)));
  }
}

// True for a bright disc whose edge is at most half overexposed, apart from all rings: the dots of
// a code, even an unreadable one, are no targets.
bool IsPlain(const FoundTarget& disc, const FoundTargets& found) {
  constexpr double kMaxBurnt = 0.5;
  constexpr double kOfTarget = 3.4;  // radii, as far as a ring and what belongs to it reach
  if (disc.number || disc.contrast <= 0 || disc.saturated_share > kMaxBurnt) return false;
  const auto apart = [&](double column_px, double row_px, double radius_px) {
    return std::hypot(disc.disc.column_px - column_px, disc.disc.row_px - row_px) >
           kOfTarget * radius_px;
  };
  return std::all_of(found.targets.begin(), found.targets.end(),
                     [&](const FoundTarget& other) {
                       return !other.number || apart(other.disc.column_px, other.disc.row_px,
                                                     other.disc.semi_major_px);
                     }) &&
         std::all_of(found.rejected.begin(), found.rejected.end(),
                     [&](const RejectedTarget& other) {
                       return apart(other.column_px, other.row_px, other.radius_px);
                     });
}

void AddPlain(const FoundTargets& found, double extra_sigma_px, SurveyPicture& picture) {
  for (const FoundTarget& disc : found.targets) {
    if (!IsPlain(disc, found)) continue;
    const double sigma_px =
        std::hypot(std::max(disc.sigma_column_px, disc.sigma_row_px), extra_sigma_px);
    picture.plain.push_back({disc.disc.column_px, disc.disc.row_px, sigma_px, disc.disc});
  }
}

Result<Page> ReadPicture(const std::filesystem::path& path) {
  auto pages = TRY(machine::ReadPages(path));
  if (pages.size() != 1) {
    return Fail(
        fmt::format("{}: {} pictures in one file; one is needed", path.string(), pages.size()));
  }
  Page page = std::move(pages.front());
  if (page.channels == 1) return page;
  return part_alignment::GreyPicture(page.width, page.height, page.samples);
}

}  // namespace

Result<SurveyPicture> ReadSurveyPicture(const std::string& name, const PageView& grey,
                                        const SurveyReadOptions& options,
                                        part_alignment::FinderWorkspace& workspace,
                                        std::vector<std::string>& notices) {
  part_alignment::FinderOptions finder = options.finder;
  finder.plain_discs = options.plain;
  const auto found = TRY(part_alignment::FindTargets(grey, options.book, finder, workspace));
  SurveyPicture picture;
  picture.name = name;
  picture.width_px = grey.width;
  picture.height_px = grey.height;
  for (const FoundTarget& target : found.targets) {
    if (!target.number) continue;
    const double sigma_px =
        std::hypot(std::max(target.sigma_column_px, target.sigma_row_px), options.extra_sigma_px);
    picture.observations.push_back(
        {std::to_string(*target.number), target.disc.column_px, target.disc.row_px, sigma_px});
    picture.discs.push_back(target.disc);
  }
  if (options.plain) AddPlain(found, options.extra_sigma_px, picture);
  NoteRejected(found, name, notices);
  return picture;
}

Result<SurveyReading> ReadSurveyPictures(const std::vector<std::filesystem::path>& paths,
                                         const SurveyReadOptions& options,
                                         const std::function<void(const std::string&)>& tell) {
  SurveyReading reading;
  part_alignment::FinderWorkspace workspace;
  std::set<std::string> names;
  for (const std::filesystem::path& path : paths) {
    const std::string name = path.filename().string();
    if (!names.insert(name).second) {
      return Fail(
          fmt::format("{}: a picture of this name came before: the same twice tells nothing "
                      "new; give each its own name",
                      path.string()));
    }
    const auto grey = TRY(ReadPicture(path));
    auto picture = ReadSurveyPicture(name, grey.view(), options, workspace, reading.notices);
    if (!picture) {
      return Fail(fmt::format("{}: {}", path.string(), picture.error().message),
                  picture.error().kind);
    }
    tell(fmt::format("{}: {} coded targets{}", name, picture->observations.size(),
                     options.plain ? fmt::format(", {} plain discs", picture->plain.size()) : ""));
    reading.pictures.push_back(std::move(*picture));
  }
  return reading;
}

}  // namespace trammel::procedure
