// docs/howto/tap.md names every finding, so that who meets one can look it up.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

std::string Document() {
  std::ifstream file(TRAMMEL_TAP_DOCUMENT);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(FindingDocs, EveryFindingHasItsRowInTheDocument) {
  const std::string document = Document();
  int named = 0;
  for (int i = 1; i < 256; ++i) {
    const std::string name(Name(static_cast<FindingCode>(i)));
    if (name == Name(FindingCode::kNone)) {
      continue;
    }
    ++named;
    EXPECT_NE(document.find("| `" + name + "` |"), std::string::npos)
        << name << " has no row in docs/howto/tap.md, section \"Failure modes\"";
    const std::string sentence = Explain({static_cast<FindingCode>(i), 12345, 54321});
    EXPECT_NE(sentence, Explain({FindingCode::kNone, 0, 0})) << name;
    EXPECT_TRUE(sentence.ends_with(".")) << sentence;
  }
  EXPECT_GT(named, 40);
}

TEST(FindingDocs, NoRowNamesWhatTheCodeDoesNotKnow) {
  std::istringstream lines(Document());
  bool in_section = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) {
      in_section = line.starts_with("## Failure modes");
    }
    if (!in_section || !line.starts_with("| `")) {
      continue;
    }
    const std::string name = line.substr(3, line.find('`', 3) - 3);
    bool known = false;
    for (int i = 1; i < 256; ++i) {
      known = known || Name(static_cast<FindingCode>(i)) == name;
    }
    EXPECT_TRUE(known) << name;
  }
}

}  // namespace
}  // namespace trammel::tap
