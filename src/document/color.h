// The report's colours.
#pragma once

#include <array>
#include <string>

namespace trammel::report {

/// sRGB, each 0 … 1.
struct Color {
  double red = 0;
  double green = 0;
  double blue = 0;
  double alpha = 1;
};

[[nodiscard]] constexpr Color Rgb(unsigned hex, double alpha = 1) {
  return {static_cast<double>((hex >> 16) & 0xffU) / 255,
          static_cast<double>((hex >> 8) & 0xffU) / 255, static_cast<double>(hex & 0xffU) / 255,
          alpha};
}

[[nodiscard]] constexpr Color WithAlpha(const Color& color, double alpha) {
  return {color.red, color.green, color.blue, alpha};
}

inline constexpr Color kInk = Rgb(0x1d2430);
inline constexpr Color kMuted = Rgb(0x5a6472);
inline constexpr Color kGrid = Rgb(0xe3e7ec);
inline constexpr Color kPaper = Rgb(0xffffff);
inline constexpr Color kUnseen = Rgb(0xd9dce1);  ///< where nothing was measured

// Told apart by every common form of colour blindness, and in grey by their lightness (50, 67, 80):
// after Okabe & Ito, Color Universal Design (2008).
inline constexpr Color kBlue = Rgb(0x0a5fa5);
inline constexpr Color kVermilion = Rgb(0xd9631e);
inline constexpr Color kSky = Rgb(0x56b4e9);
inline constexpr Color kGreen = Rgb(0x00734f);
inline constexpr Color kGrey = Rgb(0x8a94a3);

/// Letters on a map's colours: the same by day and night.
inline constexpr Color kOnLight = Rgb(0x11161d);
inline constexpr Color kOnDark = Rgb(0xfcfdfe);

/// A colour of the palette, and what stands for it on a dark card.
struct PaletteColor {
  Color light;
  Color dark;
};
inline constexpr Color kDarkCard = Rgb(0x1d232b);
inline constexpr std::array<PaletteColor, 10> kPalette = {{{kInk, Rgb(0xe8ecf1)},
                                                           {kMuted, Rgb(0xa3adba)},
                                                           {kGrid, Rgb(0x353e49)},
                                                           {kPaper, kDarkCard},
                                                           {kUnseen, Rgb(0x4a535f)},
                                                           {kBlue, Rgb(0x63aef0)},
                                                           {kVermilion, Rgb(0xf28a4e)},
                                                           {kSky, Rgb(0x8fd0f5)},
                                                           {kGreen, Rgb(0x4cc79d)},
                                                           {kGrey, Rgb(0x8a94a3)}}};

/// "#1d2430", without the alpha.
[[nodiscard]] std::string HexText(const Color& color);

/// Rules that turn the palette's colours in inline SVG for a dark card; pictures and the colours of
/// maps stay.
[[nodiscard]] std::string DarkPaletteStyle();

/// From dark violet to light yellow, with lightness (CIE L*) rising evenly, so that equal steps
/// look equal and a grey copy says the same. @param fraction  clamped to 0 … 1; NaN gives 0.
[[nodiscard]] Color MapColor(double fraction);

/// CIE 1976 lightness of an opaque colour, 0 … 100.
[[nodiscard]] double Lightness(const Color& color);

}  // namespace trammel::report
