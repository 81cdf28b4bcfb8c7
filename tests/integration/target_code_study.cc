// Rings in a mirror, and of ink that is no word of the book: none is read, and each is named.
//
// TRAMMEL_TARGETS: pictures of each of twelve, 4 without it. TRAMMEL_TARGETS_SEED: reported figures
// are those of 600000; development uses seeds below 1000.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "part_alignment/targets/ring_finder.h"
#include "support/target_picture.h"

namespace trammel {
namespace {

using part_alignment::CodeBook;
using test::DrawnTarget;
using test::PinholeView;

constexpr double kTurn = 2 * std::numbers::pi;

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}
std::uint64_t Seed() { return FromEnvironment("TRAMMEL_TARGETS_SEED", 600000); }
std::uint64_t Pictures() { return FromEnvironment("TRAMMEL_TARGETS", 4); }

// Rings as a book's, but of ink that is none of its words.
TEST(TargetCodeStudy, RingsOfNoWordAreNamed) {
  const CodeBook book = part_alignment::MakeCodeBook(14).value();
  const CodeBook other = part_alignment::MakeCodeBook(12).value();
  struct Ink {
    const char* name;
    int bits;
    std::function<std::uint32_t(std::uint32_t word, Random& random)> change;
  };
  const Ink inks[] = {
      {"all ink", 14, [](auto, auto&) { return 0x3fffu; }},
      {"half of it", 14, [](auto, auto&) { return 0x7fu; }},
      {"every second", 14, [](auto, auto&) { return 0x1555u; }},
      {"one segment", 14, [](auto, auto&) { return 1u; }},
      {"one bit wrong", 14, [](auto word, auto& r) { return word ^ 1u << r.Below(14); }},
      {"two wrong", 14,
       [](auto word, auto& r) {
         const auto first = r.Below(14);
         return word ^ 1u << first ^ 1u << (first + 1 + r.Below(13)) % 14;
       }},
      {"of 12 segments", 12,
       [&](auto, auto& r) { return other.words[r.Below(other.words.size())]; }},
      {"of 13", 13, [](auto word, auto&) { return word & 0x1fffu; }},
  };
  fmt::print("\n| ring | read | silent | rejected |\n|---|---|---|---|\n");
  part_alignment::FinderWorkspace workspace;
  for (const Ink& ink : inks) {
    Random random(Seed());
    std::map<std::string, int> reasons;
    std::size_t read = 0;
    int silent = 0;
    const std::uint64_t count = 12 * Pictures();
    for (std::uint64_t i = 0; i < count; ++i) {
      PinholeView view;
      view.radius = random.Uniform(0.6, 2);
      view.tilt_rad = random.Uniform(0, 1);
      view.tilt_towards_rad = random.Uniform(0, kTurn);
      view.turn_rad = random.Uniform(0, kTurn);
      DrawnTarget target = test::PinholeTarget(100, 100, view);
      target.bits = ink.bits;
      target.word = ink.change(book.words[random.Below(book.words.size())], random);
      const auto page = test::Expose(test::Draw(200, 200, {target}, {}), 1, random);
      const auto found = part_alignment::FindTargets(page.view(), book, {}, workspace);
      ASSERT_TRUE(found);
      read += found->targets.size();
      silent += found->targets.empty() && found->rejected.empty() ? 1 : 0;
      for (const auto& one : found->rejected) {
        ++reasons[std::string(part_alignment::ToString(one.reason))];
      }
    }
    std::string named;
    for (const auto& [reason, times] : reasons) named += fmt::format(" {} {}", times, reason);
    fmt::print("| {} | {} of {} | {} |{} |\n", ink.name, read, count, silent, named);
    EXPECT_EQ(read, 0) << ink.name;
    EXPECT_EQ(silent, 0) << ink.name;
  }
}

// Every word of every book, in a mirror.
TEST(TargetCodeStudy, MirroredRingsAreNotRead) {
  for (const int bits : {12, 14, 20}) {
    const CodeBook book = part_alignment::MakeCodeBook(bits).value();
    part_alignment::FinderWorkspace workspace;
    Random random(Seed());
    int read = 0;
    int said = 0;
    int count = 0;
    const std::size_t step = bits == 20 ? 16 : 1;
    for (std::size_t i = 0; i < book.words.size(); i += step) {
      PinholeView view;
      view.radius = 1.2;
      view.mirrored = true;
      view.tilt_rad = random.Uniform(0, 0.7);
      view.tilt_towards_rad = random.Uniform(0, kTurn);
      view.turn_rad = random.Uniform(0, kTurn);
      DrawnTarget target = test::PinholeTarget(50, 50, view);
      target.bits = bits;
      target.word = book.words[i];
      const auto page = test::Expose(test::Draw(100, 100, {target}, {}), 1, random);
      const auto found = part_alignment::FindTargets(page.view(), book, {}, workspace);
      ASSERT_TRUE(found);
      ++count;
      read += static_cast<int>(found->targets.size());
      said += found->rejected.empty() ? 0 : 1;
    }
    fmt::print("{} bits, mirrored: {} of {} read, {} named\n", bits, read, count, said);
    EXPECT_EQ(read, 0);
    EXPECT_EQ(said, count);
  }
}

}  // namespace
}  // namespace trammel
