#include "machine/linuxcnc/linuxcnc_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "base/check.h"

namespace trammel::machine {
namespace {

using Eigen::Vector3d;

// NaN lies nowhere.
bool Within(const Vector3d& mm, const Vector3d& low_mm, const Vector3d& high_mm) {
  return (mm.array() >= low_mm.array()).all() && (mm.array() <= high_mm.array()).all();
}

std::string At(const Vector3d& mm) {
  return fmt::format("X {:.6g} Y {:.6g} Z {:.6g}", mm.x(), mm.y(), mm.z());
}

std::string Text(const LinuxCncTravel& travel) {
  return fmt::format("{} … {} mm", At(travel.low_mm), At(travel.high_mm));
}

}  // namespace

Result<LinuxCncTravel> ParseTravel(const std::string& shown) {
  LinuxCncTravel travel;
  std::istringstream stream(shown);
  std::string word;
  for (int i = 0; i < 6; ++i) {
    stream >> word;
    double& bound_mm = i % 2 == 0 ? travel.low_mm[i / 2] : travel.high_mm[i / 2];
    if (!word.empty() && word.find_first_not_of('#') == std::string::npos) continue;
    std::istringstream number(word);
    double told_mm = 0;
    if (!(number >> told_mm) || !number.eof() || std::isnan(told_mm)) {
      return Fail(fmt::format("LinuxCNC shows the limits of its axes as \"{}\", which cannot be "
                              "read; six numbers were expected",
                              Clipped(shown)),
                  ErrorKind::kMachine);
    }
    bound_mm = std::clamp(told_mm, -kFarthest_mm, kFarthest_mm);
  }
  if (!(travel.low_mm.array() < travel.high_mm.array()).all()) {
    return Fail(fmt::format("LinuxCNC tells the travel {}, which is none; look at MIN_LIMIT and "
                            "MAX_LIMIT in its INI file",
                            Text(travel)),
                ErrorKind::kMachine);
  }
  return travel;
}

Result<void> CheckToldPlace(const Vector3d& machine_mm, const LinuxCncTravel& travel) {
  const Vector3d beyond_mm = Vector3d::Constant(1);
  if (Within(machine_mm, travel.low_mm - beyond_mm, travel.high_mm + beyond_mm)) return {};
  return Fail(fmt::format("LinuxCNC says that the machine is at {}, where it cannot be: its axes "
                          "reach from {}; this is a fault of the controller or its scales",
                          At(machine_mm), Text(travel)),
              ErrorKind::kMachine);
}

Result<void> CheckTarget(const Vector3d& machine_mm, const LinuxCncTravel& travel) {
  if (Within(machine_mm, travel.low_mm, travel.high_mm)) return {};
  return Fail(fmt::format("{} lies outside the travel of the machine, {}; nothing was moved there",
                          At(machine_mm), Text(travel)),
              ErrorKind::kSafety);
}

int PiecesOf(double way_mm, double piece_mm) {
  TRAMMEL_CHECK(way_mm >= 0 && way_mm <= 4 * kFarthest_mm && piece_mm >= 0.01,
                "way = {} mm, piece = {} mm", way_mm, piece_mm);
  return std::max(1, static_cast<int>(std::ceil(way_mm / piece_mm)));
}

std::string Clipped(const std::string& said) {
  constexpr std::size_t kShown = 200;
  return said.size() <= kShown ? said : said.substr(0, kShown) + " …";
}

}  // namespace trammel::machine
