#pragma once
// Inner loops in two forms, chosen when the program is loaded: for any x86-64, and for processors with AVX2.

/// Before a function whose loops work on each element by itself: such loops give the same bits in both forms (no sums
/// across elements, no contraction of products and sums). Left out where a sanitizer's own start-up would be in the
/// way.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TS_WIDE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define TS_WIDE_CLONES
#endif
