; The installer for Windows. scripts/package installer calls makensis with:
;   VERSION   0.3.0
;   TREE      the folder of the files to install
;   FILES     a text of this language that installs the files, and their total size in KIB
;   REMOVAL   a text of this language that deletes what was installed, and nothing else
;   OUTPUT    the installer's file
;
; An administrator installs for everyone, in Program Files; anyone else for themselves, without an administrator. For a room of
; machines: typodont-VERSION-windows-x86_64-setup.exe /S [/AllUsers | /CurrentUser] [/D=FOLDER]

; A program for 64-bit Windows, as what it installs.
Target amd64-unicode
SetCompressor /SOLID lzma
SetDateSave off
ManifestDPIAware true
Name "Typodont ${VERSION}"
BrandingText " "
OutFile "${OUTPUT}"
XPStyle on

!define UNINSTALL "Software\Microsoft\Windows\CurrentVersion\Uninstall\Typodont"
!define APP_PATH "Software\Microsoft\Windows\CurrentVersion\App Paths\typodont.exe"

!define MULTIUSER_EXECUTIONLEVEL Highest
!define MULTIUSER_MUI
!define MULTIUSER_INSTALLMODE_COMMANDLINE
!define MULTIUSER_USE_PROGRAMFILES64
!define MULTIUSER_INSTALLMODE_INSTDIR "Typodont"
!define MULTIUSER_INSTALLMODE_INSTDIR_REGISTRY_KEY "${UNINSTALL}"
!define MULTIUSER_INSTALLMODE_INSTDIR_REGISTRY_VALUENAME "InstallLocation"
!define MULTIUSER_INSTALLMODE_DEFAULT_REGISTRY_KEY "${UNINSTALL}"
!define MULTIUSER_INSTALLMODE_DEFAULT_REGISTRY_VALUENAME "InstallLocation"
!include MultiUser.nsh
!include MUI2.nsh
!include LogicLib.nsh

!define MUI_ICON "${TREE}/typodont.ico"
!define MUI_UNICON "${TREE}/typodont.ico"
!define MUI_FINISHPAGE_RUN "$INSTDIR\typodont.exe"
!define MUI_FINISHPAGE_NOAUTOCLOSE

!insertmacro MULTIUSER_PAGE_INSTALLMODE
!insertmacro MUI_PAGE_DIRECTORY
!insertmacro MUI_PAGE_INSTFILES
!insertmacro MUI_PAGE_FINISH
!insertmacro MUI_UNPAGE_CONFIRM
!insertmacro MUI_UNPAGE_INSTFILES
!insertmacro MUI_LANGUAGE "English"
; Texts that NSIS does not have in Turkish.
!define MULTIUSER_TEXT_INSTALLMODE_TITLE "Kullanıcıları seçin"
!define MULTIUSER_TEXT_INSTALLMODE_SUBTITLE "$(^NameDA) programının kimler için kurulacağını seçin."
!define MULTIUSER_INNERTEXT_INSTALLMODE_TOP "$(^NameDA) yalnızca sizin için mi, yoksa bu bilgisayarın tüm kullanıcıları için mi kurulsun? $(^ClickNext)"
!define MULTIUSER_INNERTEXT_INSTALLMODE_ALLUSERS "Bu bilgisayarı kullanan herkes için kur"
!define MULTIUSER_INNERTEXT_INSTALLMODE_CURRENTUSER "Yalnızca benim için kur"
!insertmacro MUI_LANGUAGE "Turkish"

LangString IN_USE ${LANG_ENGLISH} "Typodont is running. Close it, then start the installation again."
LangString IN_USE ${LANG_TURKISH} "Typodont çalışıyor. Kapatın, sonra kurulumu yeniden başlatın."

VIProductVersion "${VERSION}.0"
VIAddVersionKey /LANG=${LANG_ENGLISH} "ProductName" "Typodont"
VIAddVersionKey /LANG=${LANG_ENGLISH} "ProductVersion" "${VERSION}"
VIAddVersionKey /LANG=${LANG_ENGLISH} "FileVersion" "${VERSION}"
VIAddVersionKey /LANG=${LANG_ENGLISH} "FileDescription" "Typodont installer"
VIAddVersionKey /LANG=${LANG_ENGLISH} "LegalCopyright" "Typodont contributors"

; A running program cannot be replaced or deleted. Exit status 3, and nothing is changed.
!macro refuse_while_in_use
  ${If} ${FileExists} "$INSTDIR\typodont.exe"
    ClearErrors
    FileOpen $0 "$INSTDIR\typodont.exe" a
    ${If} ${Errors}
      MessageBox MB_OK|MB_ICONSTOP "$(IN_USE)" /SD IDOK
      SetErrorLevel 3
      Quit
    ${EndIf}
    FileClose $0
  ${EndIf}
!macroend

Function .onInit
  SetRegView 64
  ; MultiUser chooses a folder of its own; one that was named by /D= stays.
  StrCpy $R0 $INSTDIR
  !insertmacro MULTIUSER_INIT
  ${If} $R0 != ""
    StrCpy $INSTDIR $R0
  ${EndIf}
FunctionEnd

Function un.onInit
  SetRegView 64
  !insertmacro MULTIUSER_UNINIT
FunctionEnd

Section
  !insertmacro refuse_while_in_use
  ; Files of an earlier version that this one no longer has.
  ReadRegStr $1 SHCTX "${UNINSTALL}" "InstallLocation"
  ${If} $1 == $INSTDIR
  ${AndIf} ${FileExists} "$INSTDIR\uninstall.exe"
    ExecWait '"$INSTDIR\uninstall.exe" /S /$MultiUser.InstallMode _?=$INSTDIR'
  ${EndIf}
  !include "${FILES}"
  SetOutPath "$INSTDIR"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  CreateShortcut "$SMPROGRAMS\Typodont.lnk" "$INSTDIR\typodont.exe" "" "$INSTDIR\typodont.ico"
  WriteRegStr SHCTX "${APP_PATH}" "" "$INSTDIR\typodont.exe"
  WriteRegStr SHCTX "${UNINSTALL}" "DisplayName" "Typodont"
  WriteRegStr SHCTX "${UNINSTALL}" "DisplayVersion" "${VERSION}"
  WriteRegStr SHCTX "${UNINSTALL}" "DisplayIcon" "$INSTDIR\typodont.ico"
  WriteRegStr SHCTX "${UNINSTALL}" "Publisher" "Typodont contributors"
  WriteRegStr SHCTX "${UNINSTALL}" "InstallLocation" "$INSTDIR"
  WriteRegStr SHCTX "${UNINSTALL}" "UninstallString" '"$INSTDIR\uninstall.exe" /$MultiUser.InstallMode'
  WriteRegStr SHCTX "${UNINSTALL}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /$MultiUser.InstallMode /S'
  WriteRegDWORD SHCTX "${UNINSTALL}" "EstimatedSize" ${KIB}
  WriteRegDWORD SHCTX "${UNINSTALL}" "NoModify" 1
  WriteRegDWORD SHCTX "${UNINSTALL}" "NoRepair" 1
SectionEnd

Section "Uninstall"
  !insertmacro refuse_while_in_use
  !include "${REMOVAL}"
  Delete "$INSTDIR\uninstall.exe"
  SetOutPath "$TEMP"
  RMDir "$INSTDIR"
  Delete "$SMPROGRAMS\Typodont.lnk"
  DeleteRegKey SHCTX "${APP_PATH}"
  DeleteRegKey SHCTX "${UNINSTALL}"
SectionEnd
