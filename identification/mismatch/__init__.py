"""Where a recording and a model disagree, what physics was left out, and how much better the model is with it."""
