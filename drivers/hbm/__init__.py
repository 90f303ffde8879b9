"""Digital transducer electronics of HBM (HBK): AED, AD101B to AD104, FIT."""
