#include "tool_offset/reading/place_choice.h"

#include <algorithm>
#include <limits>

namespace trammel::tool_offset {
namespace {

using Claims = std::vector<std::vector<PlaceClaim>>;

/// A place for each tool, and how often each cell is explained.
class Explanation {
 public:
  Explanation(const Claims& claims, std::size_t cells)
      : claims_(&claims), place_(claims.size(), -1), times_(cells, 0) {}

  [[nodiscard]] const std::vector<int>& places() const { return place_; }
  /// Cells of ink that are explained, less those missing.
  [[nodiscard]] double explained() const { return explained_; }

  void Put(std::size_t tool, int place) {
    Take(tool);
    place_[tool] = place;
    if (place < 0) return;
    explained_ += Gain(tool, place);
    for (const auto& ink : claim(tool, place).ink) {
      for (const std::uint32_t cell : ink) ++times_[cell];
    }
  }

  /// Moves one tool after the other to where it is best, but for `fixed`, until none moves.
  void Settle(std::size_t fixed, bool backwards = false) {
    constexpr int kMostRounds = 8;  // each explains more; two suffice but for ties
    bool moved = true;
    for (int round = 0; moved && round < kMostRounds; ++round) {
      moved = false;
      for (std::size_t i = 0; i < place_.size(); ++i) {
        const std::size_t tool = backwards ? place_.size() - 1 - i : i;
        if (tool == fixed) continue;
        const int before = place_[tool];
        Take(tool);
        Put(tool, BestPlace(tool));
        moved |= place_[tool] != before;
      }
    }
  }

  /// Of a tool where it stands: cells that no other explains less those missing, along an axis.
  [[nodiscard]] double Own(std::size_t tool, std::size_t axis) const {
    const PlaceClaim& at = claim(tool, place_[tool]);
    const auto alone = std::count_if(at.ink[axis].begin(), at.ink[axis].end(),
                                     [&](std::uint32_t cell) { return times_[cell] == 1; });
    return static_cast<double>(alone) - at.missing[axis];
  }

 private:
  [[nodiscard]] const PlaceClaim& claim(std::size_t tool, int place) const {
    return (*claims_)[tool][static_cast<std::size_t>(place)];
  }
  void Take(std::size_t tool) {
    const int place = place_[tool];
    if (place < 0) return;
    for (const auto& ink : claim(tool, place).ink) {
      for (const std::uint32_t cell : ink) --times_[cell];
    }
    place_[tool] = -1;
    explained_ -= Gain(tool, place);
  }
  [[nodiscard]] double Gain(std::size_t tool, int place) const {
    const PlaceClaim& at = claim(tool, place);
    std::ptrdiff_t added = 0;
    for (const auto& ink : at.ink) {
      added += std::count_if(ink.begin(), ink.end(),
                             [&](std::uint32_t cell) { return times_[cell] == 0; });
    }
    return static_cast<double>(added) - at.missing[0] - at.missing[1];
  }
  [[nodiscard]] int BestPlace(std::size_t tool) const {
    int best = -1;
    double most = 0;
    for (int place = 0; place < static_cast<int>((*claims_)[tool].size()); ++place) {
      const double gain = Gain(tool, place);
      if (gain <= most) continue;
      most = gain;
      best = place;
    }
    return best;
  }

  const Claims* claims_;
  std::vector<int> place_;
  std::vector<std::uint8_t> times_;
  double explained_ = 0;
};

/// The tool that explains most of a tool's ink as well, where it stands or would first.
int Beside(const Claims& claims, const std::vector<int>& places, std::size_t tool,
           std::vector<std::uint8_t>& mask) {
  if (claims[tool].empty()) return -1;
  const auto for_each_cell = [&](std::size_t of, const auto& visit) {
    for (const auto& ink : claims[of][static_cast<std::size_t>(std::max(0, places[of]))].ink) {
      for (const std::uint32_t cell : ink) visit(cell);
    }
  };
  for_each_cell(tool, [&](std::uint32_t cell) { mask[cell] = 1; });
  int beside = -1;
  int most = 0;
  for (std::size_t other = 0; other < places.size(); ++other) {
    if (other == tool || places[other] < 0) continue;
    int shared = 0;
    for_each_cell(other, [&](std::uint32_t cell) { shared += mask[cell]; });
    if (shared <= most) continue;
    most = shared;
    beside = static_cast<int>(other);
  }
  for_each_cell(tool, [&](std::uint32_t cell) { mask[cell] = 0; });
  return beside;
}

/// Numbers the cells that are in any claim from 0 on, and returns how many there are.
std::size_t NumberCells(Claims& claims) {
  std::vector<std::uint32_t> cells;
  const auto for_each_list = [&](const auto& visit) {
    for (auto& of_tool : claims) {
      for (PlaceClaim& claim : of_tool) {
        for (auto& ink : claim.ink) visit(ink);
      }
    }
  };
  for_each_list([&](const auto& ink) { cells.insert(cells.end(), ink.begin(), ink.end()); });
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  for_each_list([&](auto& ink) {
    for (std::uint32_t& cell : ink) {
      cell = static_cast<std::uint32_t>(std::lower_bound(cells.begin(), cells.end(), cell) -
                                        cells.begin());
    }
  });
  return cells.size();
}

}  // namespace

std::vector<PlaceChoice> ChoosePlaces(Claims claims) {
  const std::size_t cells = NumberCells(claims);
  constexpr double kNobody = std::numeric_limits<double>::infinity();
  Explanation best(claims, cells);
  best.Settle(claims.size());
  std::vector<double> lead(claims.size(), kNobody);
  // Every tool moved to each of its other places: a better whole begins anew.
  for (bool improved = true; improved;) {
    improved = false;
    std::fill(lead.begin(), lead.end(), kNobody);
    for (std::size_t tool = 0; tool < claims.size() && !improved; ++tool) {
      const int places = static_cast<int>(claims[tool].size());
      for (int place = -1; place < places && !improved; ++place) {
        if (place == best.places()[tool]) continue;
        Explanation other = best;
        other.Put(tool, place);
        other.Settle(tool);
        // From others' places and from none, in either order: overlapping claims have several
        // optima.
        for (const bool backwards : {false, true}) {
          Explanation anew(claims, cells);
          anew.Put(tool, place);
          anew.Settle(tool, backwards);
          if (anew.explained() > other.explained()) other = anew;
        }
        const double ahead = best.explained() - other.explained();
        improved = ahead < 0;  // the same sum of cells in another order is the same
        if (improved) best = other;
        for (std::size_t i = 0; i < claims.size(); ++i) {
          if (other.places()[i] != best.places()[i]) lead[i] = std::min(lead[i], ahead);
        }
      }
    }
  }
  std::vector<PlaceChoice> choices(claims.size());
  std::vector<std::uint8_t> mask(cells, 0);
  for (std::size_t tool = 0; tool < claims.size(); ++tool) {
    PlaceChoice& choice = choices[tool];
    choice.place = best.places()[tool];
    choice.beside = Beside(claims, best.places(), tool, mask);
    if (choice.place < 0) continue;
    choice.lead = lead[tool];
    choice.own = {best.Own(tool, 0), best.Own(tool, 1)};
  }
  return choices;
}

}  // namespace trammel::tool_offset
