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

std::string Plain(const std::string& text) {
  auto checked = CheckPart21(text);
  EXPECT_TRUE(checked) << checked.error().message;
  return checked ? *checked : "";
}

TEST(Part21, LaterEditionsBecomeTheFirst) {
  const std::string first = File("#1=A();\n#2=B(#1);\n");
  EXPECT_EQ(Plain(first), first);
  const std::string named =
      "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA ('a;b',('X'));\n#1=A();\n"
      "ENDSEC;\nEND-ISO-10303-21;\n";
  EXPECT_EQ(Plain(named),
            "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;              \n#1=A();\n"
            "ENDSEC;\nEND-ISO-10303-21;\n");
  // Several sections, of which one refers to another, and what edition 3 adds.
  EXPECT_EQ(Plain("ISO-10303-21;HEADER;ENDSEC;\nANCHOR;\n<a>=#1;\nENDSEC;\nREFERENCE;ENDSEC;\n"
                  "DATA('a',('X'));#1=A(#3);ENDSEC;\nDATA('b',('Y'));#3=B();ENDSEC;\n"
                  "DATA('c',('Y'));ENDSEC;END-ISO-10303-21;SIGNATURE;"),
            "ISO-10303-21;HEADER;ENDSEC;\n       \n       \n       \n                 \n"
            "DATA;           #1=A(#3);       \n                #3=B();       \n"
            "                ENDSEC;END-ISO-10303-21;SIGNATURE;");
  EXPECT_THAT(Complaint("ISO-10303-21;HEADER;ENDSEC;REFERENCE;#7=<other.stp#a>;ENDSEC;"
                        "DATA('a',('X'));#1=A(#7);ENDSEC;END-ISO-10303-21;"),
              HasSubstr("in other files"));
}

TEST(Part21, ListsAreBounded) {
  const auto list = [](std::size_t entries, const std::string& entry) {
    std::string text = "#1=A((" + entry;
    for (std::size_t i = 1; i < entries; ++i) text += "," + entry;
    return File(text + "));\n");
  };
  EXPECT_TRUE(CheckPart21(list(kMostPart21Entries, "0.")));
  EXPECT_THAT(Complaint(list(kMostPart21Entries + 1, "0.")),
              AllOf(HasSubstr("a list in line 5 has more than 20000 entries"), HasSubstr("STL")));
  EXPECT_TRUE(CheckPart21(list(kMostPart21Entries, "(0.,0.,0.)")));
  EXPECT_THAT(Complaint(list(kMostPart21Entries + 1, "(0.,0.,0.)")), HasSubstr("a list"));
  EXPECT_THAT(Complaint(list(1'000'000, "0")), HasSubstr("a list"));
  EXPECT_TRUE(CheckPart21(list(2, "'" + std::string(100'000, ',') + "'")));
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
