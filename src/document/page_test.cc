#include "document/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "base/random.h"
#include "document/parsers_test_support.h"

namespace trammel::report {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Frame Noise() {
  Frame noise(300, 200);
  Random random(5);
  for (auto& value : noise.bgr) value = static_cast<std::uint8_t>(255 * random.Uniform());
  return noise;
}

TEST(Page, IsWellFormedAndEscapesWhatItIsGiven) {
  Figure figure{"f", "<caption> & \xff", Canvas(50, 40)};
  figure.seen = "a \"dot\" <b>";
  figure.canvas.Text({1, 9}, "<x>", {});
  figure.narrow = Canvas(20, 20);
  const std::string page = PageBegin("<t>", "<h>") +
                           HeadCard(Verdict::kCannotTell, AnswerLine("1 < 2 mm", "95 %")) +
                           ListCard("<l>", {"<i>"}) + Card("", FigureHtml(figure)) + PageEnd();
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, AllOf(HasSubstr("cannot tell"), HasSubstr("aria-label=\"a &quot;dot&quot;"),
                          HasSubstr("class=\"narrow\""), Not(HasSubstr("<i>"))));
}

TEST(Table, NamesEachCellForThoseWhoSeeNoColumns) {
  Table table({{"tool"}, {"dx & dy"}});
  table.Row({"T1", "1"});
  table.Note("why");
  EXPECT_THAT(table.Html(), AllOf(HasSubstr("<td data-name=\"dx &amp; dy\">1</td>"),
                                  HasSubstr("colspan=\"2\">why")));
  EXPECT_THROW(table.Row({"T1"}), Bug);
}

/// Contrast by WCAG 2.1 needs 3 to 1 for what is drawn; lightness 18 apart is more than that on a
/// dark ground.
TEST(DarkPalette, EveryColourStandsOutFromTheCardButThePaper) {
  constexpr double kMin = 10;
  for (const auto& [light, dark] : kPalette) {
    const std::string name = HexText(light);
    EXPECT_THAT(DarkPaletteStyle(), HasSubstr("[fill=\"" + name + "\"]{fill:" + HexText(dark)));
    if (name == HexText(kPaper)) continue;
    EXPECT_GT(Lightness(dark) - Lightness(kDarkCard), kMin) << name;
  }
  EXPECT_GT(Lightness(kPalette[0].dark) - Lightness(kDarkCard), 60) << "letters";
}

TEST(Canvas, KeepsAPhotoAsJpegAndAMapAsItIs) {
  const Frame noise = Noise();
  const auto size = [&noise](Pixels pixels) {
    Canvas canvas(300, 200);
    canvas.Image(noise.view(), {0, 0, 300, 200}, pixels);
    return canvas.ToSvg();
  };
  const std::string photo = size(Pixels::kPhoto);
  const std::string map = size(Pixels::kExact);
  EXPECT_THAT(photo, HasSubstr("data:image/jpeg;base64,/9j/"));
  EXPECT_THAT(map, HasSubstr("data:image/png;base64,iVBOR"));
  EXPECT_LT(photo.size() * 2, map.size());
}

TEST(FittingPage, TakesThePhotosDetailAsFarDownAsNeeded) {
  const auto page_of = [](std::size_t at_most_from) {
    return FittingPage([&](std::size_t step) {
      return std::string(step >= at_most_from ? kMaxPageBytes : kMaxPageBytes + 1,
                         static_cast<char>('0' + step));
    });
  };
  EXPECT_EQ(page_of(0).front(), '0');
  EXPECT_EQ(page_of(2).front(), '2');
  EXPECT_EQ(page_of(99).front(), static_cast<char>('0' + kPhotoSteps.size() - 1));
}

TEST(FigureHtml, PhotosTakeFewerBytesWithEachStepAndAllElseStays) {
  const Frame noise = Noise();
  Figure figure{"f", "caption", Canvas(120, 80)};
  figure.canvas.Image(noise.view(), {0, 0, 120, 80}, Pixels::kPhoto);
  figure.canvas.Image(noise.view(), {0, 0, 10, 10});
  const auto rest = [](const std::string& html) {
    const std::size_t begin = html.find("base64,");
    return html.substr(0, begin) + html.substr(html.find('"', begin));
  };
  std::string before = FigureHtml(figure, kPhotoSteps[0]);
  EXPECT_EQ(FigureHtml(figure), before);
  for (std::size_t step = 1; step < kPhotoSteps.size(); ++step) {
    const std::string html = FigureHtml(figure, kPhotoSteps[step]);
    EXPECT_LT(html.size(), before.size()) << step;
    EXPECT_EQ(rest(html), rest(before)) << step;
    before = html;
  }
}

TEST(Canvas, WritesManyDotsOfOneColourAsOnePath) {
  Canvas canvas(100, 100);
  for (int i = 0; i < 50; ++i) canvas.Circle({1.0 + i, 50}, 2, kBlue);
  const std::string svg = canvas.ToSvg();
  EXPECT_LT(svg.size(), 1200U);
  EXPECT_EQ(test::XmlProblem(svg), "");
}

}  // namespace
}  // namespace trammel::report
