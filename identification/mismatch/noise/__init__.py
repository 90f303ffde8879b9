"""From rows and residuals to the covariance of a response (restricted maximum likelihood), and its whitening."""
