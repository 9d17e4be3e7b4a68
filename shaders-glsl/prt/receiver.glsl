// The parts of a sample as a receiver of light, and as a place where vectors have values.
#ifndef PRT_RECEIVER
#define PRT_RECEIVER

struct PrtReceiver {
    uint first_word;      // of its halves
    uint first_mixed;     // of its cluster
    uint count;
    uint first_link;
    uint links;
    uint first_function;  // values of its cluster's vectors
    uint first_vector;    // of its cluster
    uint vectors;
};

#endif
