#include "frame_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace trammel::test {
namespace {

struct LoggedFrame {
  double arrival_s = 0;
  std::optional<double> captured_s;
};

// The frames of a video, from its .times; damaged ones left out.
std::vector<LoggedFrame> ReadTimes(const std::filesystem::path& file) {
  std::vector<LoggedFrame> frames;
  std::istringstream text(ReadWhole(file));
  for (std::string line; std::getline(text, line);) {
    std::istringstream fields(line);
    std::string number, arrival, captured;
    if (line.empty() || line[0] == '#' || !(fields >> number >> arrival >> captured)) continue;
    if (number == "-" || number.find_first_not_of("0123456789") != std::string::npos) continue;
    LoggedFrame frame{std::stod(arrival), {}};
    if (captured != "-") frame.captured_s = std::stod(captured);
    frames.push_back(frame);
  }
  return frames;
}

const sim::CameraTruth* ByStamp(const std::vector<sim::CameraTruth>& truth, double stamp_s) {
  constexpr double kRounding_s = 2e-6;  // times are written with six decimals
  for (const sim::CameraTruth& row : truth) {
    if (std::abs(row.stamp_s - stamp_s) < kRounding_s) return &row;
  }
  return nullptr;
}

// Finds the start of a video in the camera's log: the best match of sending and arrival.
std::size_t FirstByOrder(const std::vector<sim::CameraTruth>& truth,
                         const std::vector<LoggedFrame>& frames) {
  std::size_t best = 0;
  double min_s = std::numeric_limits<double>::infinity();
  for (std::size_t begin = 0; begin + frames.size() <= truth.size(); ++begin) {
    double apart_s = 0;
    for (std::size_t i = 0; i < frames.size() && apart_s < min_s; ++i) {
      apart_s += std::abs(frames[i].arrival_s - truth[begin + i].sent_s);
    }
    if (apart_s < min_s) {
      min_s = apart_s;
      best = begin;
    }
  }
  return best;
}

}  // namespace

double MedianPlaceError_mm(const PlacedFrames& placed) {
  std::vector<double> error_mm;
  error_mm.reserve(placed.error_mm.size());
  for (const double signed_mm : placed.error_mm) error_mm.push_back(std::abs(signed_mm));
  std::sort(error_mm.begin(), error_mm.end());
  return error_mm[error_mm.size() / 2];
}

PlacedFrames CompareWithTruth(const std::filesystem::path& recording,
                              const std::vector<sim::CameraTruth>& truth,
                              double camera_offset_x_mm) {
  PlacedFrames compared;
  const auto scan = nlohmann::json::parse(ReadWhole(recording / "scan.json"));
  const auto plan = nlohmann::json::parse(ReadWhole(recording / "pattern.plan.json"));
  for (const auto& line : scan["lines"]) {
    const auto planned = std::find_if(
        plan["lines"].begin(), plan["lines"].end(), [&](const nlohmann::json& candidate) {
          return candidate["pressure_advance_s"] == line["pressure_advance_s"];
        });
    const double start_mm = planned->at("start_mm")[0].get<double>();
    const double along = planned->at("end_mm")[0].get<double>() > start_mm ? 1 : -1;
    const auto frames = ReadTimes(recording / (line["video"].get<std::string>() + ".times"));
    const auto& positions = line["frame_positions_mm"];
    const std::size_t first =
        !frames.empty() && !frames.front().captured_s ? FirstByOrder(truth, frames) : 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      if (positions[i].is_null()) {
        ++compared.unplaced;
        continue;
      }
      const sim::CameraTruth* row = nullptr;
      if (i < frames.size() && frames[i].captured_s) {
        row = ByStamp(truth, *frames[i].captured_s);
      } else if (i < frames.size() && first + i < truth.size()) {
        row = &truth[first + i];
      }
      if (row == nullptr) {
        ++compared.unmatched;
        continue;
      }
      const double true_mm = (row->machine.x_mm + camera_offset_x_mm - start_mm) * along;
      compared.error_mm.push_back(positions[i].get<double>() - true_mm);
    }
  }
  return compared;
}

}  // namespace trammel::test
