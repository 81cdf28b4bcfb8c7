#include "machine/moonraker/client/move_log.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr std::size_t kNumbers = 4;  // before the two vectors of a row
constexpr double kLargest = 1e10;    // limit of time, duration, velocity, acceleration
constexpr double kFarthestMove_mm = 1e6;

bool ReadVector(const json& list, std::array<double, 3>& into) {
  if (!list.is_array() || list.size() != into.size()) return false;
  for (std::size_t i = 0; i < into.size(); ++i) {
    if (!list[i].is_number() || !(std::abs(list[i].get<double>()) <= kFarthestMove_mm))
      return false;
    into[i] = list[i].get<double>();
  }
  return true;
}

std::optional<TrapezoidMove> ReadMove(const json& row) {
  if (!row.is_array() || row.size() < kNumbers + 2) return std::nullopt;
  for (std::size_t i = 0; i < kNumbers; ++i) {
    if (!row[i].is_number() || !(std::abs(row[i].get<double>()) <= kLargest)) return std::nullopt;
  }
  TrapezoidMove move;
  move.print_time_s = row[0].get<double>();
  move.duration_s = row[1].get<double>();
  move.start_velocity_mm_s = row[2].get<double>();
  move.acceleration_mm_s2 = row[3].get<double>();
  if (move.duration_s < 0 || !ReadVector(row[4], move.start_mm) ||
      !ReadVector(row[5], move.direction)) {
    return std::nullopt;
  }
  return move;
}

}  // namespace

void MoveLog::Add(const json& batch) {
  const json* data = Member(batch, "data");
  if (data == nullptr || !data->is_array()) return;
  for (const json& row : *data) {
    if (const std::optional<TrapezoidMove> move = ReadMove(row)) Put(*move);
  }
}

void MoveLog::Put(const TrapezoidMove& move) {
  const auto place = std::lower_bound(moves_.begin(), moves_.end(), move.print_time_s,
                                      [](const TrapezoidMove& known, double print_time_s) {
                                        return known.print_time_s < print_time_s;
                                      });
  if (place != moves_.end() && place->print_time_s == move.print_time_s) {
    *place = move;
    return;
  }
  moves_.insert(place, move);
  if (moves_.size() > capacity_) moves_.pop_front();
}

std::vector<TrapezoidMove> MoveLog::Overlapping(double from_s, double to_s) const {
  std::vector<TrapezoidMove> found;
  for (const TrapezoidMove& move : moves_) {
    if (move.print_time_s <= to_s && move.print_time_s + move.duration_s >= from_s) {
      found.push_back(move);
    }
  }
  return found;
}

bool MoveLog::Reaches(double print_time_s) const {
  return !moves_.empty() && moves_.back().print_time_s >= print_time_s;
}

}  // namespace trammel::machine
