#include "machine/cad/part21.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/step_text.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Complaint(const std::string& text) {
  const auto checked = CheckPart21(text);
  EXPECT_FALSE(checked) << text.substr(0, 200);
  return checked ? "" : checked.error().message;
}

std::string File(const std::string& data) {
  return "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n" + data + "ENDSEC;\nEND-ISO-10303-21;\n";
}

TEST(Part21, AWholeFilePasses) {
  EXPECT_TRUE(CheckPart21(test::StepText({{}}, "mm")));
  EXPECT_TRUE(CheckPart21("\xEF\xBB\xBF /* a CAD program's */ \r\n" +
                          File("#1=A('it''s; (\"',(#2,$,*));/* ; */\n#2 = (B(1.)C(\"0F\"));\n")));
}

TEST(Part21, CutAnywhereItIsNeverWhole) {
  const std::string text = test::StepText({{}}, "inch");
  const std::size_t end = text.find("END-ISO-10303-21;") + std::string("END-ISO-10303-21;").size();
  for (std::size_t n = 0; n < end; n += n < 2000 || n + 200 > end ? 1 : 37) {
    EXPECT_FALSE(CheckPart21(text.substr(0, n))) << n;
  }
  EXPECT_THAT(Complaint(text.substr(0, 3000)),
              AllOf(HasSubstr("ends in line"), HasSubstr("cut short")));
}

TEST(Part21, WhatIsNoStepIsNamed) {
  EXPECT_THAT(Complaint("solid part\nendsolid\n"), HasSubstr("no STEP file"));
  EXPECT_THAT(Complaint(""), HasSubstr("no STEP file"));
  EXPECT_FALSE(LooksLikePart21("/* a comment without end"));
  EXPECT_TRUE(LooksLikePart21(" /* x */ ISO-10303-21;"));
}

TEST(Part21, WhatIsReferredToIsThereOnce) {
  EXPECT_THAT(Complaint(File("#1=A(#7);\n")), HasSubstr("refers to #7"));
  EXPECT_THAT(Complaint(File("#1=A();\n#1=B();\n")), HasSubstr("#1 is there twice"));
  EXPECT_THAT(Complaint(File("#99999999999=A();\n")), HasSubstr("no number from 1"));
  EXPECT_THAT(Complaint(File("#=A();\n")), HasSubstr("in line 5"));
}

TEST(Part21, WhatDoesNotCloseIsNamed) {
  EXPECT_THAT(Complaint(File("#1=A((1);\n")), HasSubstr("parentheses"));
  EXPECT_THAT(Complaint(File("#1=A(1));\n")), HasSubstr("parentheses"));
  EXPECT_THAT(Complaint(File("#1=A('x);\n")), HasSubstr("cut short"));
  EXPECT_THAT(Complaint(File("#1=A(" + std::string(100'000, '('))), HasSubstr("parentheses"));
  EXPECT_THAT(Complaint("ISO-10303-21;\nEND-ISO-10303-21;\n"), HasSubstr("section DATA"));
  EXPECT_THAT(Complaint("ISO-10303-21;\nDATA;\nHEADER;\n"), HasSubstr("within another"));
}

}  // namespace
}  // namespace trammel::machine
