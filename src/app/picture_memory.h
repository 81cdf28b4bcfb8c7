// What the pictures of an analysis take from the system.
#pragma once

namespace trammel::app {

/// Keeps freed memory for the next picture: every step of an analysis takes and frees some of a
/// photo's size, and to give it back each time costs a fifth of the whole analysis, in pages that
/// the system clears again.
void KeepPicturesMemory();

}  // namespace trammel::app
