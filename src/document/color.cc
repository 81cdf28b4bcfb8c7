#include "document/color.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trammel::report {
namespace {

// D65, the white of sRGB (IEC 61966-2-1).
constexpr std::array<double, 3> kWhite = {0.95047, 1.0, 1.08883};
constexpr double kCieDelta = 6.0 / 29.0;

double Linear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double Encoded(double linear) {
  const double bounded = std::clamp(linear, 0.0, 1.0);
  return bounded <= 0.0031308 ? 12.92 * bounded : 1.055 * std::pow(bounded, 1 / 2.4) - 0.055;
}

double FromLab(double f) {
  return f > kCieDelta ? f * f * f : 3 * kCieDelta * kCieDelta * (f - 4.0 / 29.0);
}

Color LabToColor(double lightness, double a, double b) {
  const double fy = (lightness + 16) / 116;
  const double x = kWhite[0] * FromLab(fy + a / 500);
  const double y = kWhite[1] * FromLab(fy);
  const double z = kWhite[2] * FromLab(fy - b / 200);
  return {Encoded(3.2406 * x - 1.5372 * y - 0.4986 * z),
          Encoded(-0.9689 * x + 1.8758 * y + 0.0415 * z),
          Encoded(0.0557 * x - 0.2040 * y + 1.0570 * z)};
}

}  // namespace

std::string HexText(const Color& color) {
  const auto byte = [](double part) {
    return static_cast<int>(std::lround(std::clamp(part, 0.0, 1.0) * 255));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.red), byte(color.green), byte(color.blue));
}

std::string DarkPaletteStyle() {
  std::string style;
  for (const auto& [light, dark] : kPalette) {
    style += fmt::format("svg [fill=\"{0}\"]{{fill:{1}}}svg [stroke=\"{0}\"]{{stroke:{1}}}\n",
                         HexText(light), HexText(dark));
  }
  return style;
}

Color MapColor(double fraction) {
  const double t = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  // A path through Lab: hue from violet over blue and green to yellow. The chroma stays just below
  // what sRGB can show, which is least for the blue-greens.
  const double hue_rad = 5.30 - 3.60 * t;
  const double chroma = 25 + 130 * (t - 0.35) * (t - 0.35);
  const double lightness = 14 + 76 * t;
  return LabToColor(lightness, chroma * std::cos(hue_rad), chroma * std::sin(hue_rad));
}

double Lightness(const Color& color) {
  const double y =
      0.2126 * Linear(color.red) + 0.7152 * Linear(color.green) + 0.0722 * Linear(color.blue);
  return y > kCieDelta * kCieDelta * kCieDelta
             ? 116 * std::cbrt(y) - 16
             : 116 * (y / (3 * kCieDelta * kCieDelta) + 4.0 / 29.0) - 16;
}

}  // namespace trammel::report
