#include "base/rejection.h"

#include <fmt/format.h>

#include <algorithm>

namespace trammel {

void RejectionTally::Add(std::initializer_list<std::string> owners, bool rejected) {
  const auto note = [rejected](Count& count) {
    ++count.observations;
    count.rejected += rejected ? 1 : 0;
  };
  note(all_);
  for (const std::string& owner : owners) note(owners_[owner]);
}

AdjustmentCheck RejectionTally::Check(int redundancy) const {
  AdjustmentCheck check{all_.observations, all_.rejected, redundancy, {}};
  const auto most = std::max_element(
      owners_.begin(), owners_.end(),
      [](const auto& a, const auto& b) { return a.second.rejected < b.second.rejected; });
  const int of_one = most == owners_.end() ? 0 : most->second.rejected;
  if (all_.rejected - of_one <= kMaxRejected * all_.observations) return check;
  check.contradiction = fmt::format(
      "{} of {} observations ({:.0f} %) contradict the others; outliers are {:.0f} % "
      "and one whole picture or target at most",
      check.rejected, check.observations, 100 * check.rejected_share(), 100 * kMaxRejected);
  if (of_one > 0) {
    check.contradiction += fmt::format("; {} contradicts most: {} of its {}", most->first, of_one,
                                       most->second.observations);
  }
  return check;
}

std::string CheckText(const AdjustmentCheck& check) {
  return fmt::format("redundancy {}; {} of {} observations rejected ({:.1f} %)", check.redundancy,
                     check.rejected, check.observations, 100 * check.rejected_share());
}

}  // namespace trammel
