'use strict';
/* global viewer */
viewer.show(document.querySelector('script.scene'));
