#!/bin/bash
cd /tmp/h/lead/main || exit
export PATH=/work/main/.venv/bin:$PATH PYTHONPATH=$1:/tmp/h/ci/tools PYTHONDONTWRITEBYTECODE=1
export CPU_LOG=/tmp/h/ci/tools/$2.cpu; rm -f $CPU_LOG; shift 2
exec python -m pytest -p cpuplug -q -p no:cacheprovider "$@"
