#include "tool_offset/original/original_test_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::tool_offset {
namespace {

class Writer {
 public:
  explicit Writer(const OriginalPrint& print)
      : print_(print), turn_rad_(print.rotation_deg * std::numbers::pi / 180) {}

  std::string Write() {
    const double n = static_cast<double>(print_.tools.size());
    across_mm_ = 22 * n - 3;
    text_ = fmt::format("G28\nM83\nT{}\n", print_.reference);
    Box();
    for (const bool tested : {false, true}) {
      if (!tested) {
        for (const bool vertical : {true, false}) {
          for (std::size_t i = 0; i < print_.tools.size(); ++i) Pair(i, vertical, false);
        }
        continue;
      }
      for (std::size_t i = 0; i < print_.tools.size(); ++i) {
        Pair(i, true, true);
        Pair(i, false, true);
      }
    }
    return text_ + "G1 Z25\nM84\n";
  }

 private:
  std::string At(double u, double v) const {
    const double c = std::cos(turn_rad_);
    const double s = std::sin(turn_rad_);
    return fmt::format("X{:.3f} Y{:.3f}", print_.centre_x_mm + c * u - s * v,
                       print_.centre_y_mm + s * u + c * v);
  }
  void Travel(double u, double v) { text_ += "G1 " + At(u, v) + " F1800\n"; }
  void Draw(double u, double v) { text_ += "G1 " + At(u, v) + " E0.2195 F1800\n"; }

  void Box() {
    for (const double inset : {0.0, 0.4, 0.8}) {
      const double u = (across_mm_ + 81) / 2 - inset;
      const double v = (std::max(across_mm_, 68.0) + 10) / 2 - inset;
      Travel(-u, -v);
      Draw(u, -v);
      Draw(u, v);
      Draw(-u, v);
      Draw(-u, -v);
    }
  }

  // Both combs of a pair that one tool draws.
  void Pair(std::size_t i, bool vertical, bool tested) {
    text_ += fmt::format(";print {} interlocked {} pattern {}\n",
                         vertical ? "vertical" : "horizontal", tested ? "signal" : "reference", i);
    if (tested) text_ += fmt::format("T{}\n", print_.tools[i]);
    const double du = tested && !print_.moved.empty() ? print_.moved[i][0] : 0;
    const double dv = tested && !print_.moved.empty() ? print_.moved[i][1] : 0;
    for (const int k : {0, 1}) {
      const double aside = 22.0 * static_cast<double>(i) + 11 * k;
      // Along the structure, and across it.
      const double start = vertical ? -35 : (across_mm_ + 73) / 2 - 70;
      const double edge = (vertical ? -(across_mm_ + 73) / 2 : -across_mm_ / 2) + aside;
      const bool down = tested && k == 1;
      const double first = start + (!tested ? 2 : down ? 68.75 : 0);
      const auto place = [&](double along, double cross) {
        return vertical ? std::pair{edge + cross + du, along + dv}
                        : std::pair{along + du, edge + cross + dv};
      };
      const double spine = tested ? 0 : 8;
      const double tip = tested ? 6 : 2;
      const double way = down ? -1 : 1;
      const auto go = [&](double along, double cross, bool ink) {
        const auto [u, v] = place(along, cross);
        ink ? Draw(u, v) : Travel(u, v);
      };
      go(first, spine, false);
      for (int finger = 0; finger < 17; ++finger) {
        const double along = first + way * 4 * finger;
        go(along, tip, finger > 0);
        const auto [u, v] = place(along + way * 0.75, tip);
        text_ += "G2 " + At(u, v) + " I0.1 J0.2 E0.0431 F1800\n";
        go(along + way * 0.75, spine, true);
        const double outside = spine + (tested ? -0.375 : 0.375);
        go(along + way * 1.125, outside, true);
        go(along + way * 3.625, outside, true);
        go(along + way * 4, spine, true);
      }
    }
  }

  const OriginalPrint& print_;
  double turn_rad_;
  double across_mm_ = 0;
  std::string text_;
};

}  // namespace

std::string WriteOriginalGcode(const OriginalPrint& print) { return Writer(print).Write(); }

}  // namespace trammel::tool_offset
