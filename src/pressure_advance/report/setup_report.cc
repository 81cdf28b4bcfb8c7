#include "pressure_advance/report/setup_report.h"

#include <fmt/format.h>

#include "base/check.h"
#include "document/html.h"
#include "document/page.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

std::string SetupHead(const pa::SetupResult& result) {
  if (result.verdict() == Verdict::kGood) {
    return HeadCard(
        Verdict::kGood,
        "<p class=\"value\">Laser and camera are measured</p>\n"
        "<p class=\"quiet\">Each true value lies in its interval 95 times in 100.</p>\n");
  }
  return HeadCard(result.verdict(), fmt::format("<p class=\"value\">No complete set of values</p>\n"
                                                "<p class=\"reason\">{}</p>\n",
                                                EscapeHtml(result.reason())));
}

std::string SetupFacts(const SetupView& view) {
  std::string out = "<p class=\"facts\">";
  const char* between = "";
  for (const auto& [name, value] : view.facts) {
    out += fmt::format("{}{}: {}", between, EscapeHtml(name), EscapeHtml(value));
    between = " · ";
  }
  return out + "</p>\n";
}

std::string SetupTable(const SetupView& view) {
  Table table({{""}, {"value"}, {"interval"}, {"", true}});
  for (const SetupValue& value : SetupValues(*view.result)) {
    const Measured& measured = *value.value;
    if (measured.good()) {
      const Quantity& quantity = measured.quantity();
      table.Row({value.name, ValueText(quantity.value, quantity.interval95, value.style),
                 IntervalText(quantity.interval95, value.style), EscapeHtml(value.about)});
    } else {
      table.Row({value.name, VerdictWords(measured.verdict()), "", EscapeHtml(measured.reason())});
    }
  }
  return Card("What was measured", table.Html());
}

std::string SetupNext(const SetupView& view) {
  if (view.section.empty()) {
    return Card(
        "What to do next",
        "<p>Nothing is written. Put right what the reason above names, then run <code>trammel pa "
        "setup</code> again.</p>\n");
  }
  return Card("What to do next",
              fmt::format("<p>Put this into trammel.toml, or let <code>trammel pa "
                          "setup --write FILE</code> do it:</p>\n<pre>{}</pre>\n",
                          EscapeHtml(view.section)));
}

}  // namespace

std::string SetupReport(const SetupView& view, const std::optional<Figure>& figure) {
  TRAMMEL_CHECK(view.seen != nullptr && view.result != nullptr && view.mark != nullptr, "no view");
  return FittingPage([&](std::size_t step) {
    std::string page = PageBegin("Camera set-up", "Camera and laser on the print head");
    page += SetupFacts(view);
    page += SetupHead(*view.result);
    page += SetupNext(view);
    page += ListCard("Crop, threshold and exposure", view.advice.lines);
    if (figure) page += Card("", FigureHtml(*figure, kPhotoSteps[step]));
    page += SetupTable(view);
    return page + PageEnd();
  });
}

}  // namespace trammel::report
