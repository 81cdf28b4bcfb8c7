// Lets clang 16 compile qpdf's headers as C++20: it instantiates std::vector's constexpr destructor
// for an element that is still incomplete. Here the destructor is not constexpr. Included before
// anything else.
#pragma once

#include <memory>
#include <string>
#pragma push_macro("_GLIBCXX20_CONSTEXPR")
#undef _GLIBCXX20_CONSTEXPR
#define _GLIBCXX20_CONSTEXPR
#define __fill_a1 __fill_a1_of_bits  // declared before, as constexpr; nothing fills bits
#include <vector>
#undef __fill_a1
#pragma pop_macro("_GLIBCXX20_CONSTEXPR")
