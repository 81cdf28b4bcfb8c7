#include "sim/print/conditions.h"

#include <fmt/format.h>

#include <cstddef>

namespace trammel::sim {

std::array<Condition, 12> AllConditions() {
  std::array<Condition, 12> all;
  std::size_t next = 0;
  for (const Plate plate : {Plate::kMatte, Plate::kTextured, Plate::kPei}) {
    for (const Filament filament : {Filament::kBlack, Filament::kWhite}) {
      for (const bool ambient : {true, false}) all[next++] = {plate, filament, ambient};
    }
  }
  return all;
}

std::string ToString(const Condition& condition) {
  const char* plate = condition.plate == Plate::kMatte      ? "matte"
                      : condition.plate == Plate::kTextured ? "textured"
                                                            : "pei";
  return fmt::format("{}-{}-{}", plate, condition.filament == Filament::kBlack ? "black" : "white",
                     condition.ambient ? "ambient" : "dark");
}

Result<Condition> ParseCondition(std::string_view name) {
  std::string known;
  for (const Condition& condition : AllConditions()) {
    const std::string candidate = ToString(condition);
    if (candidate == name) return condition;
    known += (known.empty() ? "" : ", ") + candidate;
  }
  return Fail(
      fmt::format("there is no condition \"{}\"; choose one of {}", name.substr(0, 60), known));
}

}  // namespace trammel::sim
