"""How far the assessment of results can be trusted itself: verdict, covariance, free motions."""
