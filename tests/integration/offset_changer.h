// A virtual tool changer whose second tool lands beside its kept offset, for the tests of offset
// start and of offset macros.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>

#include "machine_shop.h"
#include "support/matchers.h"

namespace trammel::test {

// T1 keeps this, and lands so far beside; both the rendered sheet's truth.
inline constexpr double kKept_x_mm = 0.25, kKept_y_mm = -0.5;
inline constexpr double kTruth_x_mm = 0.1, kTruth_y_mm = -0.05;

/// A changer of two tools, with a small sheet that is quickly drawn.
inline ShopOptions Changer() {
  ShopOptions options = WithoutCamera();
  options.klipper.tools = {{0, "tool T0", {}}, {1, "tool T1", {kKept_x_mm, kKept_y_mm, 0}}};
  options.hurry = 200;
  options.config["tool_offset_pattern"] = "teeth = 9\nprint_speed = 200\n";
  return options;
}

class OffsetChanger : public testing::Test {
 protected:
  /// Renders a scan of a sheet into a file of the shop.
  void Scan(const std::string& to, const std::string& pattern = "rec/pattern.gcode",
            int seed = 41) const {
    ASSERT_THAT(shop_->Run({"sim", "sheet", pattern, "--out", to, "--seed", std::to_string(seed),
                            "--offset", fmt::format("1:{},{}", kTruth_x_mm, kTruth_y_mm),
                            "--stored", fmt::format("1:{},{}", kKept_x_mm, kKept_y_mm)}),
                Ends(0));
  }
  /// The offset of T1 that the printer keeps.
  [[nodiscard]] std::array<double, 3> Kept() const {
    std::array<double, 3> kept{};
    shop_->With([&](sim::VirtualKlipper& klipper) { kept = klipper.tools[1].offset_mm; });
    return kept;
  }
  void ExpectOffsetsUnchanged() const {
    EXPECT_EQ(Kept()[0], kKept_x_mm);
    EXPECT_EQ(Kept()[1], kKept_y_mm);
  }
  void ExpectOffsetsNew() const {
    // Five times the 95 % error of a sheet with half of the teeth, 4 um
    // (docs/howto/tool-offset.md).
    constexpr double kNear_mm = 0.02;
    EXPECT_NEAR(Kept()[0], kKept_x_mm - kTruth_x_mm, kNear_mm);
    EXPECT_NEAR(Kept()[1], kKept_y_mm - kTruth_y_mm, kNear_mm);
  }
  void ExpectAllOff() const {
    shop_->With([](sim::VirtualKlipper& klipper) {
      for (const sim::Heater* heater : klipper.Heaters()) {
        EXPECT_EQ(heater->target_c, 0) << heater->config.name;
      }
    });
  }
  [[nodiscard]] std::size_t Moves() const {
    std::size_t moves = 0;
    shop_->With([&](sim::VirtualKlipper& klipper) { moves = klipper.history().moves.size(); });
    return moves;
  }

  std::unique_ptr<MachineShop> shop_;
  PrinterLook before_;
};

}  // namespace trammel::test
